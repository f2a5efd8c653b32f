"""Studies: scenarios, proposers and seeds from a file, carried out side by side, scored and reported."""
