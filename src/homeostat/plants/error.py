"""What a case that cannot be used is refused with."""


class CaseError(ValueError):
    """A case is unknown or cannot be used; the message says what to do."""
