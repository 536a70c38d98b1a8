"""Configuration-space obstacles: Sun's sets, each for an ordered pair of machines."""
