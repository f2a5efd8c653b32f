"""The study of unknown causes: what is said of them, look by look, and whether it is right."""
