"""Thinking in a process of its own: what guard and recovery tell each other on the way between the two."""
