"""Trajectories from a posture to a goal: obstacles, way, timing under tip-over limits, checks."""
