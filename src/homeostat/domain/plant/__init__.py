"""What the tables say of a plant."""
