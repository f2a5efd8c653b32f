"""One folder per plant; adding one touches nothing else."""
