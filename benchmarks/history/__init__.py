"""What keeping a history costs: room, time of appending, time of reading."""
