"""Evaluation: scenarios with their ground truth, runs, scores. Nothing below may look in here."""
