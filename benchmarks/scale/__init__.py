"""The scale study: sites of 1 to 1,000 modules, their graph, their physics, and decisions in them."""
