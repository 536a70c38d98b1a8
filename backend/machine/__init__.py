"""Excavators: description (URDF and sidecar), kinematics and bodies."""
