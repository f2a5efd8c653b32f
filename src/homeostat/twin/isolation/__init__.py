"""Isolation: what is wrong, and whether that can be said."""
