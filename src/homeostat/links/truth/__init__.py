"""The true plant of a simulated run: its process, and how it departs from what its model says."""
