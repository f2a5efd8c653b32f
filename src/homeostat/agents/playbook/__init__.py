"""What was released before: how near an occasion is to another one, and a proposer that begins with what helped."""
