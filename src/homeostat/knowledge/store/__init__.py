"""Graph stores: in this process or behind a SPARQL endpoint."""
