"""The agent layer: one file per box of the framework."""
