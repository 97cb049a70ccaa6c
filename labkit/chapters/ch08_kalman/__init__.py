"""Chapter 8: Kalman filters."""
