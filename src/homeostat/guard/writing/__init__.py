"""The one writer: lease, flight, ramp, read-back, retry."""
