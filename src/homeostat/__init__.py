"""Homeostat: from a detected fault to a validated corrective action."""

import os

__version__ = "0.1.0"

# Read when numpy is loaded. With one thread, sums come in the same order on any number of cores, and the small matrices
# of the twin and of the diagnosis keep no second core spinning.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
