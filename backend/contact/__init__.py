"""Machines on real ground: tracks, bucket and bodies in contact with it, by MuJoCo."""

import os

# Nothing is drawn with it: without this, importing it looks for windows, in a process of its own.
os.environ.setdefault("MUJOCO_GL", "disable")
