"""What must hold of a plant's graph before anybody relies on it."""
