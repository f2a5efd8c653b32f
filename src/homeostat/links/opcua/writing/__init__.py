"""The writing side of a link."""
