"""How people reach a run that goes on: orders in files, and what a journal says of them."""
