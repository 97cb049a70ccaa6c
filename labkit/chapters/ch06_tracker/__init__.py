"""Chapter 6: a tracker on a flange."""
