"""Chapter 3: tool calibration about a pivot."""
