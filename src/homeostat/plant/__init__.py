"""Physical space: the plants that Homeostat can be attached to."""
