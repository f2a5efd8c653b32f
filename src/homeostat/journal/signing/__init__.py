"""Signatures of a journal, and the keys that make and check them."""
