"""Keeping the processes of an attached plant: started, watched, and started again."""
