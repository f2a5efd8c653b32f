"""From engineering tables to the graph of a plant."""
