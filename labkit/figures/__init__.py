"""Figures: every function takes `ax`, draws, and returns its artists; no mathematics in here."""
