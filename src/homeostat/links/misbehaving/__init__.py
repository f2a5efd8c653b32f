"""Any link, with faults of communication by a script."""
