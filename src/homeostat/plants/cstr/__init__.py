"""The continuous stirred-tank reactor."""
