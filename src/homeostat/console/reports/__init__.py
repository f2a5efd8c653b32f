"""Reports of shifts and weeks, made beside the console."""
