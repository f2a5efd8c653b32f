"""``python -m homeostat.console.reports``: ``homeostat`` within bounds; the console starts it, and nobody else."""

import os
import resource
import runpy
import sys

MOST_BYTES, MOST_CPU_S = int(sys.argv[1]), int(sys.argv[2])

if __name__ == "__main__":
    os.nice(10)
    resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (MOST_CPU_S, MOST_CPU_S))  # also where the console has gone
    sys.argv[:] = ["homeostat", *sys.argv[3:]]
    runpy.run_module("homeostat", run_name="__main__")
