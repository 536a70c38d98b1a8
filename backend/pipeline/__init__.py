"""State and inputs to one immutable snapshot. Read `step` first."""
