"""Every command with its arguments; nothing here is slow to import."""
