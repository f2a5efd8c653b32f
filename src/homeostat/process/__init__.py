"""Physics shared by the simulated plant and the twin: compiled blocks, noise, and the batch engine."""
