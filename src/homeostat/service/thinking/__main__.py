"""``python -m homeostat.service.thinking DIR PLANT PACE DESCRIPTOR PARENT``: 'homeostat attach' starts it."""

import sys
from pathlib import Path

from homeostat.service.thinking.process import Thinking, think

if __name__ == "__main__":
    directory, plant, pace, pulse, parent = sys.argv[1:]
    think(Thinking(Path(directory), plant, float(pace), int(pulse), int(parent)))
