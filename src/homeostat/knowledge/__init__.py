"""The tool layer: what is known about a plant, and how agents ask for it."""
