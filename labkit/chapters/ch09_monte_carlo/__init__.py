"""Chapter 9: particles, maps, kidnapping."""
