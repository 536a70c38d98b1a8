"""Who drives which machine, in which state the console is, and what the sticks mean."""
