"""Probing: what is done, or waited for, only to learn which of several explanations is right."""
