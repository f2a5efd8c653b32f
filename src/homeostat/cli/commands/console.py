"""``homeostat console``: a recorded run on a page for operators, on this machine."""

import argparse
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from homeostat.cli.arguments import UsageError
from homeostat.cli.recorded_plant import plant_of_run
from homeostat.cli.run_directory import run_directory
from homeostat.console.opened import KnownPlant, OpenedRun
from homeostat.console.readings import Gathered
from homeostat.console.watched import ServiceSilent, Watched
from homeostat.journal import BrokenChain, RunStarted, read_events
from homeostat.llm.model import LanguageModel
from homeostat.plants.described import read_described
from homeostat.plants.page.flowsheet import corrections
from homeostat.plants.plant import Plant
from homeostat.record.decode import decode
from homeostat.service.attached.place import ATTACHED
from homeostat.service.doors.asking import status
from homeostat.service.order import OrderError


def carry_out(options: argparse.Namespace) -> int:
    """Show the run until Ctrl-C, which is the way to end it: 0."""
    try:
        from homeostat.cli.serving import encrypted, known, serving, signed_on
        from homeostat.console.server.app import application
        from homeostat.console.server.serve import listening, serve
    except ImportError as error:
        raise UsageError(f"the console needs {error.name!r}: pip install 'homeostat[console]'") from error
    run_dir = run_directory(options.run)
    tls, hosts = encrypted(options)
    people = known(options.people)
    attached = _started(run_dir).settings.get(ATTACHED) is True
    run = watched(run_dir, options.case) if attached else opened(run_dir, options.case)
    served = serving(people, run_dir, attached or run.goes_on(), hosts)
    other = None if options.beside is None else opened(run_directory(options.beside), options.case)
    served = replace(served, beside=other, model=_model(options), sign_on=signed_on(options, hosts))
    app = application(run, served)
    try:
        at = listening(options.port, options.address)
    except OSError as error:
        reason = f"port {options.port} cannot be listened on: {error.strerror or error}"
        raise UsageError(f"{reason}; choose another one with --port, or 0 for a free one") from error
    try:
        serve(app, at, not options.no_browser, _tell, options.address if tls is None else hosts[0], tls)
    except KeyboardInterrupt:
        print("homeostat: the console is closed", file=sys.stderr)
    return 0


def _model(options: argparse.Namespace) -> LanguageModel | None:
    """The model that says the card in other words; None where none is named, UsageError where there is none."""
    if options.explain_with is None:
        return None
    from homeostat.agents.language.named_model import NoSuchModel
    from homeostat.cli.operation import chosen_model

    try:
        return chosen_model(options.explain_with, options).make()
    except NoSuchModel as error:
        raise UsageError(f"--explain-with: {error}") from error


def opened(run_dir: Path, given: str | None) -> OpenedRun:
    """The run in ``run_dir`` with its plant, which is ``given``, or where the run had it.

    UsageError where the journal does not say how the run began; else as
    :func:`homeostat.cli.recorded_plant.plant_of_run`.
    """
    return OpenedRun(run_dir, _plant(run_dir, given))


def watched(run_dir: Path, given: str | None) -> OpenedRun:
    """The plant that is attached in ``run_dir``, followed over its service's doors; as :func:`opened`."""
    plant = _plant(run_dir, given)
    gathered = Gathered(tag.name for tag in plant.description.tags)
    service = Watched(lambda: _status(run_dir), gathered)
    service.look()
    service.begin()
    return OpenedRun(run_dir, plant, gathered, service)


def _status(run_dir: Path) -> Mapping[str, Any]:
    try:
        return status(run_dir)
    except (OrderError, OSError) as error:
        raise ServiceSilent(str(error)) from error


def _plant(run_dir: Path, given: str | None) -> KnownPlant:
    started = _started(run_dir)
    description, plant, notice = plant_of_run(started, run_dir, given)
    return KnownPlant(started.case, description, notice=notice) if plant is None else known_plant(plant, notice)


def known_plant(plant: Plant, notice: str = "") -> KnownPlant:
    """What the page needs of ``plant``; ``notice`` is what a reader must know of it."""
    described = read_described(str(plant.files.folder))
    return KnownPlant(
        title=plant.title,
        description=plant.description,
        flowsheet=described.flowsheet,
        corrections=corrections(described.name, described.flowsheet, described.settings.drawing),
        baselines=plant.baselines,
        panels=plant.panels,
        horizon_s=plant.twin.horizon_s,
        notice=notice,
        folder=str(plant.files.folder),
    )


def _tell(address: str) -> None:
    print(f"{address}  Ctrl-C ends it", flush=True)


def _started(run_dir: Path) -> RunStarted:
    """How the run began; UsageError where its journal does not say."""
    try:
        first = next(read_events(run_dir), None)
    except BrokenChain as error:
        raise UsageError(f"run {str(run_dir)!r} cannot be shown: {error}") from error
    started = None if first is None else decode(first)
    if not isinstance(started, RunStarted):
        raise UsageError(f"run {str(run_dir)!r} cannot be shown: its journal does not begin with the run's beginning")
    return started
