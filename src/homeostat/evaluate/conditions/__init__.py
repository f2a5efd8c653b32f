"""How the agents of a run are asked, and what a study leaves out of them."""
