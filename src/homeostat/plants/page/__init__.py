"""A page about a plant, from its graph and its settings: drawings and tables in one file that needs nothing else."""
