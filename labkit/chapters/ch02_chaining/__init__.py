"""Chapter 2: measuring beyond the arm's reach."""
