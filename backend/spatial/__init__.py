"""Rotations, rigid transforms, angles and boxes, vectorised over leading axes."""
