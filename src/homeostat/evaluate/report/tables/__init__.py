"""Tables of a report: typed cells, how each reads, and what stands in each table."""
