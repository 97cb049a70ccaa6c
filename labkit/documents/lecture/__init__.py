"""Lecture "Lokalisierung": chapters 7 to 9."""
