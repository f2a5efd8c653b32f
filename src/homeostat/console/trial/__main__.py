"""``python -m homeostat.console.trial``: the console starts it, and nobody else, for one question."""

import os
import pickle
import sys

from homeostat.console.text import to_json
from homeostat.console.trial.trial import tried

if __name__ == "__main__":
    os.nice(10)
    out, sys.stdout = sys.stdout, sys.stderr  # a plant's code may print
    out.write(to_json(tried(pickle.load(sys.stdin.buffer))))  # from its own parent
