"""What decisions cost against the best constant: ``python -m benchmarks.decisions``."""
