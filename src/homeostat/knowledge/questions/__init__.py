"""Questions to the graph: SPARQL templates with typed parameters and typed answers."""
