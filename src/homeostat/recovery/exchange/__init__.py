"""Where the guard's loop and recovery's thread meet."""
