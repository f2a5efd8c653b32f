"""Commands on a plant's knowledge graph."""
