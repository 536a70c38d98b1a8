"""What an agent drives: a real machine's bus, or a simulation."""
