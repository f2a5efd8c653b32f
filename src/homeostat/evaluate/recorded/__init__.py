"""A run that is kept: on disk, found again, and gone on with."""
