"""Distances between bodies: python-fcl, decided by an exact second solver."""
