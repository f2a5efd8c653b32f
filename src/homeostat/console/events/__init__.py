"""What happened: alarms in their states, and the journal line by line with what its verification says."""
