"""``homeostat link``: before a plant is attached."""
