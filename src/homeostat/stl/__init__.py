"""The rule language: signal temporal logic over tags with bounds in seconds, evaluated to signed margins."""
