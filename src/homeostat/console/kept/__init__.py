"""A run on a page that is one file: no server, no network."""
