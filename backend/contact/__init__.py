"""Machines on real ground: tracks, bucket and bodies in contact with it, by MuJoCo."""
