"""Before a link is used: a mapping is drafted from what a server has, and checked against plant and server."""
