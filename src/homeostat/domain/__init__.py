"""The nouns of Homeostat: frozen and pure; the standard library, numpy and the parser library only."""
