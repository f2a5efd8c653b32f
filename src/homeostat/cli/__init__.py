"""The command line: one file per command; what takes long to import is imported by the command that needs it."""
