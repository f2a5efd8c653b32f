"""The engineering tables as typed rows: what every cell may be, and what it may refer to."""
