"""Figures of a study's report, as SVG that follows from the rows alone."""
