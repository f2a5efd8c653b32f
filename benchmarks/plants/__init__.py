"""Measurements on whole plants."""
