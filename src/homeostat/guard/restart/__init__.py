"""What a journal keeps of the guard, and how a guard goes on from it."""
