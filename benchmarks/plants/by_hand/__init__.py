"""A kernel of the reactor as it would be written by hand: a yardstick, which no plant uses."""
