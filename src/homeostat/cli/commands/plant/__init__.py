"""Commands about a plant's folder."""
