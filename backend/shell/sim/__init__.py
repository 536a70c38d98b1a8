"""Simulated machines: dynamics, work cycles, radio, and the process that publishes them."""
