"""Tables of signals: reading them, and whether two belong together."""
