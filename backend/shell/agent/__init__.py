"""The agent on a machine: the only one that grants leases, obeys commands and enforces limits."""
