"""A simulated plant as an OPC UA server: its control system, its faults, and everything that a server may do wrong."""
