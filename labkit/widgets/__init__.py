"""Figures one can touch; all interaction goes through `Stage`."""
