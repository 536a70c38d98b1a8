"""The site file: which machines, where, in which frame, with which limits."""
