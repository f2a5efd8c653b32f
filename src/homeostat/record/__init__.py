"""The record of a run: its folder, and what its events say."""
