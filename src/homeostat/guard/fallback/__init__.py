"""Trips, the latch and the fallback that acts."""
