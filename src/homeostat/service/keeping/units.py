"""The unit for systemd that ships: one service per attached plant, with a watchdog."""

from importlib.resources import files


def unit() -> str:
    """The text of ``homeostat@.service``."""
    return files(__package__).joinpath("homeostat@.service").read_text("utf-8")
