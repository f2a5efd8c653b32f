"""Grounding: what agents ask the knowledge graph, and what a language model is shown of it."""
