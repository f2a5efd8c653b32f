"""Recovery: from what monitoring noticed to a request that the guard may release; it owns no plant."""
