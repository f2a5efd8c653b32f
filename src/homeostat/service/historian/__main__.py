"""``python -m homeostat.service.historian DIR FOLDER DESCRIPTOR``: 'homeostat attach' starts it, and nobody else."""

import sys
from pathlib import Path

from homeostat.service.historian.process import Keeping, keep

if __name__ == "__main__":
    directory, folder, pulse = sys.argv[1:]
    sys.exit(keep(Keeping(Path(directory), Path(folder), int(pulse))))
