"""Tennessee Eastman: reactor, condenser, separator, compressor and stripper with a recycle (Downs and Vogel 1993)."""
