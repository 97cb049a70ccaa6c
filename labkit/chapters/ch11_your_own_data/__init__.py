"""Chapter 11: one's own poses, from the file to a calibration one would sign."""
