"""Isolation: which cause, known or not, of what size and since when, makes the model agree with the readings."""
