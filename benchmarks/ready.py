"""How long a process takes until it has a plant and its kernel."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path


def ready_s(plant: str, cache: Path) -> float:
    """Wall-clock time of a process that loads ``plant``, by folder or name, with machine code in ``cache`` [s]."""
    load = f"load_plant({plant!r}, learned=False).model.kernel.load()"
    code = f"from homeostat.plants.plant import load_plant; {load}"
    begun = time.perf_counter()
    subprocess.run([sys.executable, "-c", code], check=True, env=os.environ | {"NUMBA_CACHE_DIR": str(cache)})
    return time.perf_counter() - begun
