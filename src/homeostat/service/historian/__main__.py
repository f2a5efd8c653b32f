"""``python -m homeostat.service.historian DIR FOLDER DESCRIPTOR PARENT``: 'homeostat attach' starts it."""

import sys
from pathlib import Path

from homeostat.service.historian.process import Keeping, keep

if __name__ == "__main__":
    directory, folder, pulse, parent = sys.argv[1:]
    sys.exit(keep(Keeping(Path(directory), Path(folder), int(pulse), int(parent))))
