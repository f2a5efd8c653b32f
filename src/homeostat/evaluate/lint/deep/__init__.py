"""Checks that simulate: the model's contract, the fault-free plant, loops, numbers, faults and fallbacks."""
