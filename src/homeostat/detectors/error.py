"""What is wrong with a table, or with what was asked of the detectors."""


class DetectionError(ValueError):
    """Nothing can be detected; one line with the thing, the value, the limit and the remedy."""
