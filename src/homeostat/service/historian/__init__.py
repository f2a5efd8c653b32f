"""The historian of an attached plant: a process that keeps every sample, and the guard's line to it."""
