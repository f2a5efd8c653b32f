"""The sequencer: what was released is taken step by step."""
