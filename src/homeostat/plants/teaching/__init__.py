"""What is normal for a plant, learned from fault-free runs or from its history."""
