"""The console, measured: pictures for the ten-second test, times in a browser, cost of watchers."""
