"""``homeostat plant try``: a plant that nobody supervises, as text and picture, before anything was learned of it."""

import argparse
import math
from pathlib import Path

from homeostat.cli.arguments import UsageError, apart
from homeostat.domain.quotation import printable
from homeostat.evaluate.scenario import scenario
from homeostat.evaluate.trial import Trial, try_out
from homeostat.journal.beside.files import write_whole
from homeostat.plants.equations import refuse_wrong_units
from homeostat.plants.plant import load_plant
from homeostat.process.batch import ProcessError
from homeostat.record.figure.figure import draw


def carry_out(options: argparse.Namespace) -> int:
    """Simulate, show and draw; 0 where the plant starts in its time and keeps every hard limit, else 1."""
    plant = load_plant(options.case, learned=False)
    refuse_wrong_units(plant.name, plant.description, plant.model)
    chosen = scenario(plant, options.fault, options.seed, options.onset, options.severity, options.end)
    path = _picture(options.out, f"{plant.name}-{chosen.fault}-{chosen.seed}.png")
    apart(path, plant.files.folder, plant.files.contents)
    try:
        tried = try_out(plant, chosen)
    except ProcessError as broke:
        raise UsageError(f"plant {plant.name!r} cannot be simulated: {broke}") from None
    write_whole(path, draw(tried))
    for line in _told(tried):
        print(printable(line))
    print(f"{path}: the run as a picture")
    return 0 if tried.well else 1


def _picture(out: Path | None, usual: str) -> Path:
    """The file to write: ``out``, where the ``usual`` name goes into a folder and a name without an ending gets one."""
    path = Path(usual) if out is None else out
    if path.is_dir():
        return path / usual
    return path if path.suffix else path.with_name(f"{path.name}.png")


def _told(tried: Trial) -> list[str]:
    machine = tried.plant.description.machine
    lines = [f"{at_s:6.10g} s  {machine.state(state).label} ({state})" for state, at_s in tried.record.states]
    lines += _not_ready(tried)
    for each in tried.missed:
        what = "violated" if each.hard else "missed"
        lines.append(f"{each.first_s:6.10g} s  {each.name} {what}: '{each.formula}', {each.total_s:g} s in all")
    return lines if tried.missed else [*lines, "every limit is kept"]


def _not_ready(tried: Trial) -> list[str]:
    """Why it is not in operation in its time, and what to do; nothing where it is."""
    end_s, longest_s = tried.scenario.end_s, tried.longest_s
    look = "look at the guard that ends start-up (transitions.csv), gains and setpoints, and at the picture"
    if math.isfinite(tried.started_s):
        if not tried.late:
            return []
        took = f"start-up takes {tried.started_s:g} s, longer than start_up_s = {longest_s:g} s (states.csv)"
        return [f"not ready: {took}; state twice the longest fault-free start, or {look}"]
    if not tried.record.states:
        waits = f"it stays in {tried.state!r}: '{tried.plant.started}' never holds in {end_s:g} s"
    else:
        waits = f"it is still in {tried.state!r} after {end_s:g} s, a state of start-up"
    return [f"not ready: {waits}; {look}, or give it more time (--end, or end_s in case.toml)"]
