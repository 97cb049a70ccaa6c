"""Chapter 4: Newton, Gauss-Newton and trust region."""
