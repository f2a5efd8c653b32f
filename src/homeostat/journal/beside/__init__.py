"""The files beside a journal: trajectories, texts, and the manifest that closes a run."""
