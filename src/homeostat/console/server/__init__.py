"""The server of the page: answers, a stream of moments, a port of this machine."""
