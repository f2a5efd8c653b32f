"""Scores of a run against its ground truth; the only place that may say 'recovered'."""
