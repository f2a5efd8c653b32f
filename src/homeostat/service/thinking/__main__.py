"""``python -m homeostat.service.thinking``: 'homeostat attach' starts it, and nobody else.

``DIR PLANT PACE DESCRIPTOR PARENT CONSULTED`` thinks; ``--check PLANT`` says whether it could, by its standard input.
"""

import logging
import sys
from pathlib import Path

from homeostat.service.thinking.consulted import Consulted

if __name__ == "__main__":
    if sys.argv[1] == "--check":
        from homeostat.service.thinking.consulting import check

        logging.basicConfig(level=logging.WARNING, format="%(message)s")
        sys.exit(check(sys.argv[2], Consulted.from_text(sys.stdin.read())))
    from homeostat.service.thinking.process import Thinking, think

    directory, plant, pace, pulse, parent, consulted = sys.argv[1:]
    logging.basicConfig(level=logging.WARNING, format="homeostat: %(message)s")
    think(Thinking(Path(directory), plant, float(pace), int(pulse), int(parent), Consulted.from_text(consulted)))
