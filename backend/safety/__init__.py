"""Safety concerns and the arbiter: each concern returns the same record, the severest wins."""
