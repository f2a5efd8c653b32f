"""What an attached plant's journal tells of the last days, before anybody raises its mode."""
