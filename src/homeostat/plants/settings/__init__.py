"""What an engineer sets for a plant, with bounds and units."""
