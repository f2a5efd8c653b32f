"""Piping of a flowsheet: junctions whose heads nobody knows, and what lies between them and the vessels.

    pipe, valve    K q |q| + R q        K of a valve: that of the open one divided by its opening squared
    check valve    the same, and nothing back
    pump           gives a n^2 + b n q - c q^2 at the speed n, behind a check valve (affinity laws)

Flows are those of the levels and openings at the start of a tick. See ``solver`` for how they are found.

Hand check: no lift, K = 92.8 m/(L/s)^2 in all, a = 2.141 m, b = 2.728 m s/L, c = 28.82 m s^2/L^2 and n = 0.9013:
1.739 + 2.459 q = 121.6 q^2 gives q = 0.130 L/s.
"""

from __future__ import annotations

from typing import final

from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.given import FlowsheetError, operand
from homeostat.process.blocks.hydraulics.solver import ONE_WAY, PIPE, PUMP
from homeostat.process.blocks.parts import Branch, Network, held
from homeostat.process.blocks.term import ZERO, Operand, Term, maximum, term

MOST_JUNCTIONS = 12
"""Most junctions of one network: its equations are solved directly."""


def throttled(resistance: Operand, opening: Operand) -> Term:
    """Resistance behind a valve that is open by ``opening`` [1]: K / u^2. Check: K = 10 and u = 0.5 give 40."""
    return term(resistance) / maximum(opening, 1e-6) ** 2


@final
class Piping:
    """One network; heads [m], flows [L/s], resistances [m/(L/s)^2]."""

    def __init__(self, sheet: Flowsheet, name: str) -> None:
        """A network of ``sheet``, whose columns begin with ``name``."""
        self._sheet = sheet
        self._network = Network(name, [], [])
        sheet.networks(self._network)

    def junction(self, name: str) -> Term:
        """A place where branches meet; gives its head [m]."""
        if len(self._network.junctions) == MOST_JUNCTIONS:
            raise FlowsheetError(f"network {self._network.name}: more than {MOST_JUNCTIONS} junctions; make it two")
        self._network.junctions.append(self._sheet.named(f"{self._network.name}_{name}"))
        return held(self._network.junctions[-1])

    def pipe(self, name: str, ends: tuple[Term, Term], resistance: Operand, one_way: bool = False) -> Term:
        """A pipe or valve from one end to the other, each a junction or a head [m]; gives its flow [L/s].

        ``one_way``: behind a check valve.
        """
        return self._add(name, ONE_WAY if one_way else PIPE, ends, term(resistance), (ZERO, ZERO, ZERO))

    def pump(self, name: str, ends: tuple[Term, Term], curve: tuple[Operand, Operand, Operand], speed: Term) -> Term:
        """A pump with its check valve; gives its flow [L/s].

        ``curve``: a [m], b [m/(L/s)], and c with the resistance of its pipe [m/(L/s)^2]; ``speed``: n [1].
        """
        a, b, c = map(term, curve)
        return self._add(name, PUMP, ends, c, (a, b, operand(f"pump {name}", "speed", speed)))

    def _add(
        self, name: str, kind: float, ends: tuple[Term, Term], resistance: Term, rest: tuple[Term, Term, Term]
    ) -> Term:
        junctions = [held(each) for each in self._network.junctions]
        first, last = (operand(f"branch {name}", "end", each) for each in ends)
        if not {first, last} & set(junctions):
            raise FlowsheetError(f"branch {name}: neither end is a junction of network {self._network.name}; name one")
        column = self._sheet.named(f"{self._network.name}_{name}")
        self._network.branches.append(Branch(column, kind, (first, last), resistance, rest))
        return held(column)
