"""The digital twin: it follows the plant's snapshots, explains them, and says what an action set would do."""
