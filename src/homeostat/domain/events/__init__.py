"""What a journal says happened: one frozen type per event."""
