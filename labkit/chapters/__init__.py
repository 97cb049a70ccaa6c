"""The chapters, one folder a notebook: `exercises` with their mistakes, `figures`, and `stages` that can be touched."""
