"""Reactor, separator, stripper and the header in which everything gaseous meets (Downs and Vogel 1993).

What a vessel holds of each substance is integrated, n_i [kmol], and its temperature in place of its energy: with
E = sum n_i h_i(T) the balance dE/dt = Q is dT/dt = (Q - sum dn_i/dt h_i(T)) / sum n_i c_i(T), so nothing is iterated.
In reactor and separator A, B and C are gas, and of D to H what is liquid counts; vapour stands over that at the
pressures x_i p_i(T) (Raoult), and is not held up.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, final

from homeostat.plants.tennessee_eastman.streams import HOUR, Stream
from homeostat.plants.tennessee_eastman.substances import (
    FT3,
    GAS,
    LB,
    MASS,
    NAMES,
    WORK,
    liquid_capacity,
    liquid_heat,
    molar_volume,
    total,
    vapour_capacity,
    vapour_heat,
    vapour_pressure,
    weighted,
)
from homeostat.process.blocks import Flowsheet, Term, maximum, number, term

_TRACE: Final = 1e-6
"""Least amount of a substance [kmol]: nothing is divided by 0."""
_FILM: Final = number(4.0, "kmol")
"""Least liquid that a vapour is in equilibrium with: not published, and less than half of what shuts the plant down."""
_WALL: Final = number(0.5, "MJ/K")
"""Least heat capacity: not published, and a fortieth of what a drum holds; one that is empty keeps its temperature."""
_GASES: Final = range(3)
_HEAVY: Final = range(3, 8)
ZERO: Final = term(0.0)


@dataclass(frozen=True)
class Held:
    """Amounts and temperature at which a run begins: the published base case, and its sizes."""

    amounts: tuple[float, ...]
    """Of A to H [lb-mol]."""
    t: float
    """Temperature [degC]."""


class Vessel:
    """Amounts of the substances and a temperature, which change by streams and heat."""

    def __init__(self, sheet: Flowsheet, name: str, start: Held) -> None:
        """``name`` begins the names of its states: ``R_A`` [kmol] to ``R_T`` [degC]."""
        self._sheet, self.name = sheet, name
        begun = zip(NAMES, start.amounts, strict=True)
        self.n = [sheet.state(f"{name}_{substance}", "kmol", n * LB, least=_TRACE) for substance, n in begun]
        self.t = sheet.state(f"{name}_T", "degC", start.t)
        self.kelvin = self.t + 273.15
        """Temperature [K]."""

    def _stored(self, i: int) -> Term | None:
        """Energy of a kmol of substance ``i`` [MJ/kmol]; None where it does not count."""
        raise NotImplementedError

    def _capacity(self, i: int) -> Term:
        """Its change with the temperature [MJ/(kmol K)]."""
        raise NotImplementedError

    def balance(self, inflows: Sequence[Stream], outflows: Sequence[Stream], heat: Term, made: Sequence[Term]) -> None:
        """State how it changes: ``heat`` [MJ/h] comes in besides, and ``made`` of each substance [kmol/h]."""
        rates = []
        for i, created in enumerate(made):
            rates.append(total([s.parts[i] for s in inflows]) + created - total([s.parts[i] for s in outflows]))
        for n, rate in zip(self.n, rates, strict=True):
            self._sheet.rate(n, rate / HOUR)
            self._sheet.rests(n)
        energy = total([s.heat for s in inflows]) - total([s.heat for s in outflows]) + heat
        kept = [(i, stored) for i in range(len(NAMES)) if (stored := self._stored(i)) is not None]
        warmed = energy - total([rates[i] * stored for i, stored in kept])
        self._sheet.rests(self.t)
        heated = maximum(total([self.n[i] * self._capacity(i) for i, _ in kept]), _WALL)
        self._sheet.rate(self.t, warmed / heated / HOUR)


@final
class Drum(Vessel):
    """Liquid D to H under a vapour of all eight: the reactor and the separator."""

    def __init__(self, sheet: Flowsheet, name: str, start: Held, size: float) -> None:
        """``size``: its volume [ft3]."""
        super().__init__(sheet, name, start)
        heavy = total([self.n[i] for i in _HEAVY])
        wetted = maximum(heavy, _FILM)
        self.x = [ZERO if i in _GASES else self.n[i] / wetted for i in range(len(NAMES))]
        """Mole fractions of the liquid."""
        self.liquid = total([self.n[i] * molar_volume(i, self.t) for i in _HEAVY])
        """Volume of the liquid [m3]."""
        self.gas = maximum(number(size * FT3, "m3") - self.liquid, number(1.0, "m3"))
        """Volume of the gas [m3]."""
        gases = [self.n[i] * GAS * self.kelvin / self.gas for i in _GASES]
        self.partial = [*gases, *(self.x[i] * vapour_pressure(i, self.t) for i in _HEAVY)]
        """Partial pressures [kPa]."""
        self.p = total(self.partial)
        """Pressure [kPa]."""
        self.y = [each / self.p for each in self.partial]
        """Mole fractions of the vapour."""
        self.mass = weighted(self.y, MASS)
        """Molar mass of the vapour [kg/kmol]."""
        self.density = heavy / self.liquid
        """Of the liquid [kmol/m3]."""

    def _stored(self, i: int) -> Term | None:
        return None if i in _GASES else liquid_heat(i, self.t)

    def _capacity(self, i: int) -> Term:
        return liquid_capacity(i, self.t)


@final
class Sump(Vessel):
    """Liquid of all eight substances: the bottom of the stripper."""

    def __init__(self, sheet: Flowsheet, name: str, start: Held) -> None:
        super().__init__(sheet, name, start)
        everything = total(self.n)
        self.x = [n / everything for n in self.n]
        """Mole fractions."""
        self.liquid = total([n * molar_volume(i, self.t) for i, n in enumerate(self.n)])
        """Volume [m3]."""
        self.density = everything / self.liquid
        """Of the liquid [kmol/m3]."""

    def _stored(self, i: int) -> Term:
        return liquid_heat(i, self.t)

    def _capacity(self, i: int) -> Term:
        return liquid_capacity(i, self.t)


@final
class Header(Vessel):
    """Gas of all eight substances, of which the reactor is fed."""

    def __init__(self, sheet: Flowsheet, name: str, start: Held, size: float) -> None:
        """``size``: its volume [ft3]."""
        super().__init__(sheet, name, start)
        everything = total(self.n)
        self.y = [n / everything for n in self.n]
        """Mole fractions."""
        self.p = everything * GAS * self.kelvin / number(size * FT3, "m3")
        """Pressure [kPa]."""
        self.mass = weighted(self.y, MASS)
        """Molar mass [kg/kmol]."""

    def _stored(self, i: int) -> Term:
        return vapour_heat(i, self.t) - WORK * self.kelvin

    def _capacity(self, i: int) -> Term:
        return vapour_capacity(i, self.t) - WORK
