"""Reference policies: what would have come of a run with perfect hindsight, or with nobody acting."""
