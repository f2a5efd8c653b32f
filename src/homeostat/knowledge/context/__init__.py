"""The facts of a plant in the neighbourhood of a question."""
