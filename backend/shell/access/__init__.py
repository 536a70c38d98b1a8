"""Who may come in: users, sessions, one-time links, the audit log, certificates. No HTTP here."""
