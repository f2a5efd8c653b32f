"""Playbooks are filled: from runs that are over, and offline over faults, severities and states."""
