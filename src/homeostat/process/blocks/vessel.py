"""A stirred vessel: volume, temperature and concentrations from what flows in and out, heats and reacts.

    dV/dt = sum F_in - sum F_out
    dC/dt = sum F_in (C_in - C) / V + r
    dT/dt = sum F_in (T_in - T) / V + sum Q / (V c)       c: heat capacity of a volume, such as cp in kJ/(L K)

Hand check: 10 L at 300 K, 0.1 L/s of 350 K: dT/dt = 0.1 (350 - 300) / 10 = 0.5 K/s.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import final

from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.given import FlowsheetError, operand, plain_number
from homeostat.process.blocks.term import TICK, ZERO, Operand, Term, maximum, minimum, number, term


@final
class Vessel:
    """What is in one vessel; its methods add what flows, heats and reacts."""

    def __init__(
        self, sheet: Flowsheet, name: str, unit: str, start: Operand, heel: float = 0.1, leak: Term | None = None
    ) -> None:
        """State ``NAME_V`` [``unit``] from ``start`` on; something is divided by no less than ``heel`` of it.

        With an empty ``name``, as of the only vessel, the state is ``V``. ``leak``: what leaks; where it is left out,
        the severity [1/s] of the fault ``NAME_leak`` times the volume.
        """
        if plain_number(f"vessel {name}", "heel", heel) <= 0.0:
            raise FlowsheetError(f"vessel {name}: heel = {heel} {unit} must be more than 0")
        self.name = name
        """Name of the equipment."""
        self.volume = sheet.state(self._column("V"), unit, start, least=0.0)
        """Liquid in it."""
        sheet.contents.append(self._column("V"))
        self.temperature: Term | None = None
        """Its temperature; None where nobody asked for it."""
        self.leak = sheet.fault(self._column("leak")) * self.volume if leak is None else leak
        """What leaks."""
        self._sheet, self._heel = sheet, number(heel, unit)
        self._inflows: list[tuple[Term, Term | None, Mapping[str, Operand]]] = []
        self._outflows: list[Term] = [self.leak]
        self._heat: list[Term] = []
        self._reacted: list[Term] = []
        self._capacity: Term | None = None
        self._reacting: dict[str, list[Term]] = {}
        sheet.rate(self.volume, self._volume_rate)

    def _column(self, what: str) -> str:
        return f"{self.name}_{what}" if self.name else what

    @property
    def wet(self) -> Term:
        """Its volume where something is divided by it: never less than the heel, or than what comes in in a tick."""
        return maximum(self.volume, maximum(self._heel, self.inflow * TICK))

    @property
    def outflow(self) -> Term:
        """Everything that leaves it."""
        return sum(self._outflows, ZERO)

    @property
    def inflow(self) -> Term:
        """Everything that is fed."""
        return sum((flow for flow, _, _ in self._inflows), ZERO)

    def heated(self, start: Operand, capacity: Operand, unit: str = "K") -> Term:
        """Keep account of its temperature [``unit``]; ``capacity``: heat that a unit of volume takes up per kelvin."""
        self.temperature = self._sheet.state(self._column("T"), unit, start)
        self._capacity = term(capacity)
        self._sheet.rate(self.temperature, self._temperature_rate)
        return self.temperature

    def holds(
        self,
        species: str,
        unit: str,
        start: Operand = 0.0,
        usual: Operand | None = None,
        least: float | None = 0.0,
    ) -> Term:
        """Keep account of a concentration [``unit``], ``NAME_SPECIES``.

        ``usual``: what it is taken to be where a plant is found running and no instrument tells. ``least``: what it
        cannot fall below; None for what may be negative, as the net charge of water that is acid.
        """
        made = self._sheet.state(self._column(species), unit, start, least=least, usual=usual)
        self._reacting[species] = []
        self._sheet.rate(made, lambda: self._species_rate(species, made))
        return made

    def feed(self, flow: Term, temperature: Operand | None = None, **concentrations: Operand) -> None:
        """``flow`` comes in, with its temperature and concentrations; what is not stated is none of that species."""
        if unknown := sorted(set(concentrations) - set(self._reacting)):
            raise FlowsheetError(f"vessel {self.name} holds no {unknown[0]!r}; say so with holds(...) first")
        self._inflows.append(
            (
                operand(f"vessel {self.name}", "flow", flow),
                None if temperature is None else term(temperature),
                concentrations,
            )
        )

    def draw(self, flow: Term) -> Term:
        """``flow`` leaves, and never more than half of what is there in a tick; gives what does."""
        return self.release(minimum(operand(f"vessel {self.name}", "flow", flow), self.volume / (2.0 * TICK)))

    def release(self, flow: Term) -> Term:
        """``flow`` leaves as it is: who states it sees to it that it is no more than there is."""
        self._outflows.append(operand(f"vessel {self.name}", "flow", flow))
        return self._outflows[-1]

    def heat(self, power: Term) -> None:
        """``power`` heats it; what is negative cools it."""
        self._heat.append(operand(f"vessel {self.name}", "power", power))

    def react(self, rate: Term, heat: Operand = 0.0, **species: float) -> None:
        """A reaction at ``rate`` [amount per volume and second], with its stoichiometry, as ``A=-1, B=1``.

        ``heat``: enthalpy of reaction per amount; negative where it heats.
        """
        pace = operand(f"vessel {self.name}", "rate", rate)
        for name, factor in species.items():
            if name not in self._reacting:
                raise FlowsheetError(f"vessel {self.name} holds no {name!r}; say so with holds(...) first")
            self._reacting[name].append(factor * pace)
        self._reacted.append(-term(heat) * pace)

    def _volume_rate(self) -> Term:
        return self.inflow - self.outflow

    def _temperature_rate(self) -> Term:
        assert self.temperature is not None and self._capacity is not None
        mixed = ZERO
        for flow, warm, _ in self._inflows:
            if warm is None:
                raise FlowsheetError(f"vessel {self.name} is heated, and a feed has no temperature; state it")
            mixed = mixed + flow * (warm - self.temperature)
        heat, reacted = sum(self._heat, ZERO), sum(self._reacted, ZERO)
        return mixed / self.wet + reacted / self._capacity + heat / (self.wet * self._capacity)

    def _species_rate(self, species: str, now: Term) -> Term:
        mixed = ZERO
        for flow, _, concentrations in self._inflows:
            mixed = mixed + flow * (term(concentrations.get(species, 0.0)) - now)
        return mixed / self.wet + sum(self._reacting[species], ZERO)
