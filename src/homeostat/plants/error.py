"""What a plant that cannot be used is refused with."""


class PlantError(ValueError):
    """A plant is unknown or cannot be used; the message says what to do."""
