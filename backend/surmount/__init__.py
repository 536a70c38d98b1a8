"""Surmounting obstacles with the arm (Jayasekara and Arisumi 2015)."""
