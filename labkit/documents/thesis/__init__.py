"""Thesis "Optimierung bei der Kalibrierung von Sensor-Roboter-Systemen", HAW Hamburg 2019: chapters 4 and 5."""
