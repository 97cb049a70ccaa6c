"""Chapter 0: course map, notation, how exercises work."""
