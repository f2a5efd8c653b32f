"""Figures of a campaign's report, as SVG that follows from the rows alone."""
