"""Chapter 10: what the documents print, recomputed."""
