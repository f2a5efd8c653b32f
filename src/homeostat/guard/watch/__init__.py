"""What the guard sees: quality of readings, trip limits, start-up, alarms."""
