"""The extra that brings the OPC UA library: said in one line where it is missing."""

import logging
from importlib.util import find_spec

from homeostat.links.errors import LinkError


def need_opcua() -> None:
    """LinkError with the remedy where the OPC UA library is not installed; what it logs is for whoever asks for it."""
    if find_spec("asyncua") is None:
        raise LinkError("OPC UA needs a library that is not installed; pip install 'homeostat[opcua]'")
    logging.getLogger("asyncua").addHandler(logging.NullHandler())
    logging.getLogger("asyncuagds").addHandler(logging.NullHandler())
