"""What a study measures, as numbers with intervals."""
