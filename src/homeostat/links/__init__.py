"""Links: the plants that Homeostat can be attached to; each implements the ports of the domain."""
