"""Homeostat: from a detected fault to a validated corrective action."""

__version__ = "0.1.0"
