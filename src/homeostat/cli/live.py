"""A run that is shown on a page while it goes on."""

import sys
import threading
from pathlib import Path
from typing import final

from homeostat.cli.commands.console import known_plant
from homeostat.cli.serving import serving
from homeostat.console.opened import OpenedRun
from homeostat.console.people.people import People
from homeostat.console.readings import Gathered
from homeostat.console.server.app import application
from homeostat.console.server.serve import listening, serve
from homeostat.domain.snapshot import Snapshot
from homeostat.plants.plant import Plant


@final
class LivePage:
    """The page of one run, served by a thread of this process on a free port; whoever looks never holds the run up."""

    def __init__(self, plant: Plant, run_dir: Path, people: People | None) -> None:
        """Serve the page of the run that is about to begin in ``run_dir``; a terminal gets a browser, too.

        ``people`` may look and order; where there are none, whoever is on this machine looks.
        """
        self._gathered = Gathered(tag.name for tag in plant.description.tags)
        run = OpenedRun(run_dir, known_plant(plant), self._gathered)
        app = application(run, serving(people, run_dir, True))
        what = (app, listening(0), sys.stdout.isatty(), _tell)
        threading.Thread(target=serve, args=what, daemon=True).start()

    def see(self, snapshot: Snapshot) -> None:
        """Take what the plant says now."""
        self._gathered(snapshot)

    def stay(self) -> None:
        """Serve until Ctrl-C."""
        print("homeostat: the page stays until Ctrl-C", file=sys.stderr, flush=True)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            return


def _tell(address: str) -> None:
    print(f"homeostat: the run is shown at {address}", file=sys.stderr, flush=True)
