"""Recorded sessions: writing, reading, playing, and turning other people's recordings into ours."""
