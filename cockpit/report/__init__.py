"""What happened in a session, as one HTML file that needs nothing else."""
