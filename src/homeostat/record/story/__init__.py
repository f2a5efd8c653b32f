"""What a run came to, in the words of a control room."""
