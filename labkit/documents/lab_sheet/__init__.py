"""Lab sheet "Kalibrierung", Hochschule Darmstadt 2016: chapters 1 to 3."""
