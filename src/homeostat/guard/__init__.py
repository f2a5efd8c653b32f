"""The guard: one decision per tick, one way to the plant; it knows the domain and the rule language."""
