"""OPC UA: a link to a plant's control system, and simulated plants as servers of it; needs the extra ``opcua``."""
