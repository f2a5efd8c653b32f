"""Equipment as terms of its equations: valves, pumps, heaters, exchangers, reactions. Each can be checked by hand."""

from __future__ import annotations

from typing import Final

from homeostat.process.blocks.term import Operand, Term, exp, limited, log, maximum, minimum, number, sqrt, term, where

GAS_CONSTANT: Final = number(8.314462618, "J/(mol K)")
"""R, CODATA 2018."""


def linear_valve(full: Operand, opening: Operand) -> Term:
    """Flow F = F_full u of a valve with linear characteristic at a constant pressure drop (IEC 60534-2-1)."""
    return term(full) * term(opening)


def equal_percentage_valve(full: Operand, opening: Operand, rangeability: Operand = 50.0) -> Term:
    """Flow F = F_full R^(u - 1), closed below u = 0.01 (IEC 60534-2-1). Check: R = 50, u = 0.5 gives 0.141 F_full."""
    u = term(opening)
    return term(full) * where(u < 0.01, 0.0, exp(log(rangeability) * (u - 1.0)))


def valve_flow(kv: Operand, opening: Operand, head: Operand) -> Term:
    """Flow F = Kv u sqrt(h), h the head or pressure drop over the valve; none against it."""
    return term(kv) * term(opening) * sqrt(head)


def pump_flow(full: Operand, speed: Operand) -> Term:
    """Flow F = F_full n of a displacement pump at speed n from 0 to 1."""
    return term(full) * term(speed)


def centrifugal_flow(curve: tuple[Operand, Operand], speed: Operand, head: Operand) -> Term:
    """Flow F = sqrt((H0 n^2 - h) / k) of a centrifugal pump against the head h; ``curve``: H0 and k, H = H0 - k F^2."""
    shut_off, steepness = map(term, curve)
    return sqrt((shut_off * term(speed) ** 2 - term(head)) / steepness)


def overflow(volume: Term, brim: Operand, rate: Operand) -> Term:
    """Flow over a weir, k (V - V_brim) where V is above the brim."""
    return term(rate) * maximum(term(volume) - term(brim), 0.0)


def heater(power: Operand, opening: Operand) -> Term:
    """Heat Q = P u of an electrical heater."""
    return term(power) * term(opening)


def exchanged(ua: Operand, warm: Operand, cold: Operand) -> Term:
    """Heat Q = UA (T_warm - T_cold) through a wall. Check: 500 W/K and 20 K give 10 kW."""
    return term(ua) * (term(warm) - term(cold))


def counter_current(ua: Operand, hot: tuple[Operand, Operand], cold: tuple[Operand, Operand]) -> Term:
    """Heat Q of a counter-current exchanger by the effectiveness-NTU method (VDI Heat Atlas, C1).

    ``hot``, ``cold``: heat capacity flow [W/K] and inlet temperature of each side. Q = eps C_min (T_hot - T_cold) with
    eps = (1 - e) / (1 - r e), e = exp(-N (1 - r)), N = UA / C_min, r = C_min / C_max; nothing where a side stands.
    Check: UA = C_min, C_max = 2 C_min gives e = 0.6065 and eps = 0.5648.
    """
    (c_hot, t_hot), (c_cold, t_cold) = ((term(c), term(t)) for c, t in (hot, cold))
    least = maximum(minimum(c_hot, c_cold), 1e-9)
    ratio = limited(least / maximum(maximum(c_hot, c_cold), 1e-9), 0.0, 0.999)
    decay = exp(-(term(ua) / least) * (1.0 - ratio))
    return (1.0 - decay) / (1.0 - ratio * decay) * least * (t_hot - t_cold)


def arrhenius(prefactor: Operand, activation: Operand, temperature: Term, gas: Operand = GAS_CONSTANT) -> Term:
    """Rate constant k0 exp(-E / (R T)); E [J/mol], T [K], ``gas`` R where a source rounds it."""
    return term(prefactor) * exp(-term(activation) / (term(gas) * term(temperature)))
