"""Monitoring: from samples to features, symptoms and hypotheses."""
