"""Agents that ask a language model: what it is shown, what it may answer, and what its answer is taken for."""
