"""Instrument errors: what hypotheses say that instruments show beyond the truth, which readings are corrected by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from homeostat.process.model import ProcessModel
from homeostat.process.moves import Move, MoveKind
from homeostat.process.types import Table
from homeostat.twin.carried import Carrier
from homeostat.twin.forecast import Ensemble


def instrument_errors(
    model: ProcessModel, carrier: Carrier, e: Ensemble, read: Mapping[str, float], variables: Mapping[str, str]
) -> tuple[dict[str, float], ...]:
    """What each member of ``e`` says of it: tag -> error in the tag's unit.

    What swings is no error that a reading could be corrected by: a moment later it is another one. ``read``: variable
    -> its last reading; ``variables``: tag -> variable.
    """
    parameters, found = _at_rest(e.parameters, e.carried.moves), []
    shown, true = model.shown_and_true(e.states, parameters, e.carried.severity, e.carried.onset_s, e.start_s)
    for m, moves in enumerate(e.carried.moves):
        says = {v: float(values[m]) for v, values in shown.items()}
        says |= carrier.shown([move for move in moves if not move.period_s], says, read, e.start_s)
        found.append({t: says[v] - float(true[v][m]) for t, v in variables.items() if v in says})
    return tuple(found)


def _at_rest(parameters: Table, moves: Sequence[Sequence[Move]]) -> Table:
    """``parameters`` of members without what their ``moves`` make them swing by now, the same shape."""
    found = parameters.copy()
    for member, own in enumerate(moves):
        for move in own:
            if move.kind is MoveKind.PARAMETER and move.period_s:
                found[member, move.column] -= move.done
    return found
