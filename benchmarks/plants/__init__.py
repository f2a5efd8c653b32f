"""What a plant in a folder takes, and what its check says of sixty mistakes that an engineer may make in one."""
