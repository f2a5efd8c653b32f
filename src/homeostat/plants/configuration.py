"""A plant's configuration as one thing: a digest over all that decides how the plant is guarded and recovered."""

import hashlib
import json
from typing import Final

from homeostat.knowledge.build.provenance import sha256
from homeostat.plants.files.folder import PlantFiles

_SCHEMA: Final = "homeostat plant configuration 1"


def configuration_digest(files: PlantFiles) -> str:
    """SHA-256 over settings, tables, mapping, graph, reference values and the plant's own code.

    It changes with any of them and does not depend on line ends, on where the folder is, or on the order of files.
    """
    named = sorted((name, sha256(content)) for name, content in files.contents.items())
    return hashlib.sha256(json.dumps([_SCHEMA, named], separators=(",", ":")).encode("ascii")).hexdigest()
