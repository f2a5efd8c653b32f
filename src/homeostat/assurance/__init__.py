"""The safety layer; it knows the domain and nothing else."""
