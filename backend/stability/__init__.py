"""Tipping over: what the ground must bear, the support polygon, limits that follow."""
