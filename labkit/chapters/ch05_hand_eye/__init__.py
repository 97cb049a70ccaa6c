"""Chapter 5: a line scanner on a robot."""
