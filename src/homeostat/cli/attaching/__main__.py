"""``python -m homeostat.cli.attaching PLANT``: 'homeostat attach' starts it, and nobody else."""

import pickle
import sys

from homeostat.cli.attaching.stated import stated
from homeostat.cli.main import notices

if __name__ == "__main__":
    try:
        with notices():
            read = pickle.dumps(stated(sys.argv[1]), pickle.HIGHEST_PROTOCOL)
    except Exception:  # it is read once more by who started this, and refused there
        sys.exit(1)
    sys.stdout.buffer.write(read)
    sys.stdout.flush()
