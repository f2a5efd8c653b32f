"""Where people reach an attached plant: two local sockets, one for each role."""
