"""Everything with a clock, a socket or a process: link, simulated machines, hub, runner, app."""
