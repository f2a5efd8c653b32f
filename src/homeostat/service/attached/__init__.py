"""A plant attached: its directory, its guard in a small process, and what is shown of both."""
