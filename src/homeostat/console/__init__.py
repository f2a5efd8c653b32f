"""The operator's screen: a run on one page, served to this machine only."""
