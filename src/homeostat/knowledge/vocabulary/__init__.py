"""The terms of the T-Box, and its ontologies."""
