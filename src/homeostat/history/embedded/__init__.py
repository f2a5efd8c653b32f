"""The store that needs nothing but a folder: a write-ahead log, Parquet files sorted by tag, a roll-up."""
