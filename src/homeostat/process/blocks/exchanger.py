"""A counter-current heat exchanger with what it holds: each side is a row of stirred cells.

    K_h/n dT_h,i/dt = C_h (T_h,i-1 - T_h,i) - UA/n (T_h,i - T_c,i)        i = 1 ... n, from the hot inlet on
    K_c/n dT_c,i/dt = C_c (T_c,i+1 - T_c,i) + UA/n (T_h,i - T_c,i)

C: heat capacity flow [kW/K], K: heat capacity of what a side holds [kJ/K] (cell method, Gaddis and Schlünder 1979).
A side that stands comes to the temperature of the other, which no steady effectiveness says. Instruments show what
leaves; where a plant is found running, the cells inside are taken to be at rest.

Hand check: C_h = C_c = UA and n cells have the effectiveness n / (2 n + 1): 1/3 with one cell, 2/5 with two, and 1/2
with very many, which is what :func:`counter_current` gives.
"""

from __future__ import annotations

from typing import Final, final

from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.given import FlowsheetError, operand, plain_number
from homeostat.process.blocks.term import ZERO, Operand, Term, term

MOST_CELLS: Final = 10
"""Most cells of a side: each is a state."""


@final
class Exchanger:
    """One exchanger; :meth:`hot` and :meth:`cold` say what flows through its sides."""

    def __init__(self, sheet: Flowsheet, name: str, ua: Operand, start: Operand, cells: int = 2) -> None:
        """States ``NAME_hot1`` ... and ``NAME_cold1`` ..., all at the temperature ``start`` at first.

        ``ua``: heat that passes per kelvin [kW/K], which the fault ``NAME_fouled`` takes its severity [1] of. ``cells``
        of each side. FlowsheetError where these are not 1 to 10.
        """
        if not 1 <= (count := plain_number(f"exchanger {name}", "cells", cells)) <= MOST_CELLS or count % 1.0:
            raise FlowsheetError(f"exchanger {name}: cells = {cells}; a side has 1 to {MOST_CELLS} of them")
        self.name = name
        """Name of the equipment."""
        self._sheet, self._cells = sheet, cells
        self._hot = [sheet.state(f"{name}_hot{i}", "K", start) for i in range(1, cells + 1)]
        self._cold = [sheet.state(f"{name}_cold{i}", "K", start) for i in range(1, cells + 1)]
        for inner in (*self._hot[:-1], *self._cold[1:]):
            sheet.rests(inner)
        share = term(ua) * (1.0 - sheet.fault(f"{name}_fouled")) / float(cells)
        self._passed = [share * (hot - cold) for hot, cold in zip(self._hot, self._cold, strict=True)]

    @property
    def hot_out(self) -> Term:
        """Temperature at which the hot side leaves."""
        return self._hot[-1]

    @property
    def cold_out(self) -> Term:
        """Temperature at which the cold side leaves: where the hot one comes in."""
        return self._cold[0]

    @property
    def duty(self) -> Term:
        """Heat that passes from the hot to the cold side."""
        return sum(self._passed, ZERO)

    def hot(self, flow: Term, inlet: Operand, held: Operand) -> None:
        """What gives heat: its heat capacity ``flow``, its ``inlet`` temperature, and the heat capacity ``held``."""
        before = [term(inlet), *self._hot[:-1]]
        self._side(operand(f"exchanger {self.name}", "flow", flow), before, self._hot, held, -1.0)

    def cold(self, flow: Term, inlet: Operand, held: Operand) -> None:
        """What takes heat: its heat capacity ``flow``, its ``inlet`` temperature, and the heat capacity ``held``."""
        before = [*self._cold[1:], term(inlet)]
        self._side(operand(f"exchanger {self.name}", "flow", flow), before, self._cold, held, 1.0)

    def _side(self, flow: Term, before: list[Term], cells: list[Term], held: Operand, sign: float) -> None:
        for come, here, passed in zip(before, cells, self._passed, strict=True):
            self._sheet.rate(here, (flow * (come - here) + sign * passed) * float(self._cells) / term(held))
