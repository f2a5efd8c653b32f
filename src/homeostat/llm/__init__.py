"""Language models: asking one, recording what it said, and what went wrong."""
