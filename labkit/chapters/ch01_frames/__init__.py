"""Chapter 1: frames from three points."""
