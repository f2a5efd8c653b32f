"""From the graph to the domain: one typed function per part of a plant, and `read_plant` for all of it."""
