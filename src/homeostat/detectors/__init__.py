"""Detectors: which rows of a table of signals are out of the ordinary, by what was learned of fault-free rows."""
