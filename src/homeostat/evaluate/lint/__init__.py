"""A lint that knows plants: what loading checks, all of it at once, and what only a simulation shows."""
