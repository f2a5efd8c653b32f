"""What goes wrong on a link.

LinkError        the link does not do what it was asked
  LeaseVoid      the wire belongs to a lease that is over
  PlantEnded     the run is over
"""


class LinkError(Exception):
    """The link does not do what it was asked; the message says what and why."""


class LeaseVoid(LinkError):
    """The wire belongs to a lease that is over; take a new one."""


class PlantEnded(LinkError):
    """The run is over; there is nothing more to read."""
