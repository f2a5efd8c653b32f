"""The refusal of a study."""


class StudyError(ValueError):
    """A study cannot be carried out as it was asked for; the message says why in one line."""
