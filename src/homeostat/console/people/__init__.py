"""Who may look and who may order: accounts in a file, sessions that the server keeps, and orders to the guard."""
