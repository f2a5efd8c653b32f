"""What a plant in a folder takes, what its check says of sixty mistakes, and whether adopted causes come back."""
