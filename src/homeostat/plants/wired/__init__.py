"""Guard, recovery and twin of a plant, wired to whatever it is read from."""
