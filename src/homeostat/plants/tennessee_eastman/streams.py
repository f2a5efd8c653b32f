"""Streams between the vessels: what flows of each substance, and what heat it carries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from homeostat.plants.tennessee_eastman.substances import liquid_heat, total, vapour_heat
from homeostat.process.blocks import Term, number

HOUR: Final = number(3600.0, "s/h")
"""The published model counts in hours, a kernel in seconds."""


@dataclass(frozen=True)
class Stream:
    """A flow of the eight substances."""

    parts: Sequence[Term]
    """Of each substance [kmol/h]."""
    heat: Term
    """Enthalpy that goes with it [MJ/h], that of liquids at 0 degC being 0."""

    @property
    def flow(self) -> Term:
        """All of it [kmol/h]."""
        return total(self.parts)


def vapour(parts: Sequence[Term], t: Term) -> Stream:
    """Vapour at ``t`` [degC]; ``parts`` in kmol/h."""
    return Stream(parts, total([f * vapour_heat(i, t) for i, f in enumerate(parts)]))


def liquid(parts: Sequence[Term], t: Term) -> Stream:
    """Liquid at ``t`` [degC]; ``parts`` in kmol/h."""
    return Stream(parts, total([f * liquid_heat(i, t) for i, f in enumerate(parts)]))


def shared(shares: Sequence[Term | float], flow: Term) -> list[Term]:
    """A ``flow`` [kmol/h] as those of the substances, by mole fractions."""
    return [x * flow for x in shares]


def both(*streams: Stream) -> Stream:
    """Streams that run together."""
    parts = [total([s.parts[i] for s in streams]) for i in range(len(streams[0].parts))]
    return Stream(parts, total([s.heat for s in streams]))
