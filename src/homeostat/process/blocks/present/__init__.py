"""From what instruments show to the states of a flowsheet, and what control goes on from."""
