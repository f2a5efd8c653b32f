"""The reading side of a link."""
