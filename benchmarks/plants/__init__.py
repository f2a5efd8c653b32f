"""Sixty mistakes that an engineer may make in a plant's folder, and what its check says of each."""
