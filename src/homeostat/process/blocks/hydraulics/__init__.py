"""Pipes, pumps and valves that meet in junctions: their flows follow from what flows in flowing out."""
