"""One look at the plant: what monitoring says, whether it is news, and what happens if nobody interferes."""
