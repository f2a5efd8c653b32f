"""Rows that follow from others: a plant with a table of instruments states each thing once."""
