"""What was measured: every sample with its quality and its times, alarms and events, kept for years."""
