"""The Tennessee Eastman plant as it truly is in a simulated run; the twin and the agents know nothing of it."""
