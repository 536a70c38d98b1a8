"""Acting near limits: three methods, end cushions, task paths, and use cases in simulated time."""
