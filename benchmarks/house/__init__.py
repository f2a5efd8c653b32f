"""What the command line costs, beside an older commit on the same host."""
