"""The eight substances A to H: what they weigh, how they evaporate, how dense they are, and what heat they carry.

Constants are those of Downs and Vogel (1993), who state them in lb-mol, ft3, mmHg and million Btu; they are converted
here with the factors that the published instruments use (1 lb-mol = 0.454 kmol, 1 ft3 = 1/35.3145 m3).

    p_i = exp(A + B / (T + C))                                   vapour pressure (Antoine), D to H
    1 / v_i = a + b T + c T^2                                    molar density of a liquid, by its mass
    h_i = M (a T + b T^2 / 2 + c T^3 / 3) [+ M h_vap]            enthalpy of a liquid [of a vapour]

T in degC; the enthalpy of a liquid at 0 degC is 0. A, B and C are gases that do not condense.
By hand: G at 120.4 degC has exp(16.43 - 2748 / 353.3) mmHg = exp(8.652) mmHg = 5.72e3 mmHg = 763 kPa.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from homeostat.process.blocks import Term, exp, number

LB: Final = 0.454
"""Pounds in a kilogram, and lb-mol in a kmol, as the published model rounds them."""
FT3: Final = 1.0 / 35.3145
"""Cubic metres in a cubic foot."""
MMHG: Final = 101.325 / 760.0
"""kPa in a mmHg."""
BTU: Final = 1055.06
"""MJ in a million Btu."""
GAS: Final = number(998.9 * MMHG * FT3 / LB, "kPa m3/(kmol K)")
"""Gas constant, as the published model rounds it."""
NAMES: Final = "ABCDEFGH"
MASS: Final = (2.0, 25.4, 28.0, 32.0, 46.0, 48.0, 62.0, 76.0)
"""Molar mass [kg/kmol]."""
_ANTOINE: Final = {
    "D": (15.92, -1444.0, 259.0), "E": (16.35, -2114.0, 265.5), "F": (16.35, -2114.0, 265.5),
    "G": (16.43, -2748.0, 232.9), "H": (17.21, -3318.0, 249.6),
}  # fmt: skip
_DENSITY: Final = (
    (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (23.3, -0.07, -2e-4), (33.9, -0.0957, -1.52e-4),
    (32.8, -0.0995, -2.33e-4), (49.9, -0.0191, -4.25e-4), (50.5, -0.0541, -1.5e-4),
)  # fmt: skip
"""Density of the liquid [lb/ft3] at T in degC."""
_LIQUID: Final = (
    (1e-6, 0.0, 0.0), (1e-6, 0.0, 0.0), (1e-6, 0.0, 0.0), (9.6e-7, 8.7e-9, 4.81e-11), (5.73e-7, 2.41e-9, 1.82e-11),
    (6.52e-7, 2.18e-9, 1.94e-11), (5.15e-7, 5.65e-10, 3.82e-12), (4.71e-7, 8.7e-10, 2.62e-12),
)  # fmt: skip
"""Heat capacity of the liquid [million Btu / (lb degF)]."""
_VAPOUR: Final = (
    (3.411e-6, 7.18e-10, 6e-13), (3.799e-7, 1.08e-9, -3.98e-13), (2.491e-7, 1.36e-11, -3.93e-14),
    (3.567e-7, 8.51e-10, -3.12e-13), (3.463e-7, 8.96e-10, -3.27e-13), (3.93e-7, 1.02e-9, -3.12e-13),
    (1.7e-7, 0.0, 0.0), (1.5e-7, 0.0, 0.0),
)  # fmt: skip
"""Heat capacity of the vapour [million Btu / (lb degF)]."""
_VAPORISATION: Final = (1e-6, 1e-6, 1e-6, 8.67e-5, 1.6e-4, 1.6e-4, 2.25e-4, 2.09e-4)
"""Heat of vaporisation [million Btu/lb]."""
_PER_DEGREE: Final = 1.8 * BTU / LB
"""From million Btu / (lb-mol degF) to MJ/(kmol K)."""
WORK: Final = number(3.57696e-6 * BTU / LB, "MJ/(kmol K)")
"""What a mole of gas pushes away, p v / T: its internal energy is less than its enthalpy by that."""


def vapour_pressure(i: int, t: Term) -> Term:
    """Pressure of the vapour over pure liquid ``i`` (D to H) at ``t`` [degC], in kPa."""
    a, b, c = _ANTOINE[NAMES[i]]
    return number(MMHG, "kPa") * exp(a + number(b, "degC") / (t + c))


def molar_volume(i: int, t: Term) -> Term:
    """Volume of a kmol of liquid ``i`` at ``t`` [degC], in m3/kmol."""
    a, b, c = (each * LB / FT3 / MASS[i] for each in _DENSITY[i])
    density = number(a, "kmol/m3") + number(b, "kmol/(m3 K)") * t + number(c, "kmol/(m3 K2)") * t * t
    return 1.0 / density


def _heat(constants: Sequence[float], mass: float, t: Term) -> Term:
    a, b, c = (each * mass * _PER_DEGREE for each in constants)
    inner = number(b / 2.0, "MJ/(kmol K2)") + number(c / 3.0, "MJ/(kmol K3)") * t
    return t * (number(a, "MJ/(kmol K)") + inner * t)


def _capacity(constants: Sequence[float], mass: float, t: Term) -> Term:
    a, b, c = (each * mass * _PER_DEGREE for each in constants)
    return number(a, "MJ/(kmol K)") + (number(b, "MJ/(kmol K2)") + number(c, "MJ/(kmol K3)") * t) * t


def liquid_heat(i: int, t: Term) -> Term:
    """Enthalpy of liquid ``i`` at ``t`` [degC], in MJ/kmol."""
    return _heat(_LIQUID[i], MASS[i], t)


def liquid_capacity(i: int, t: Term) -> Term:
    """Its change with the temperature, in MJ/(kmol K)."""
    return _capacity(_LIQUID[i], MASS[i], t)


def vapour_heat(i: int, t: Term) -> Term:
    """Enthalpy of vapour ``i`` at ``t`` [degC], in MJ/kmol."""
    return _heat(_VAPOUR[i], MASS[i], t) + number(_VAPORISATION[i] * MASS[i] * BTU / LB, "MJ/kmol")


def vapour_capacity(i: int, t: Term) -> Term:
    """Its change with the temperature, in MJ/(kmol K)."""
    return _capacity(_VAPOUR[i], MASS[i], t)


def total(terms: Sequence[Term]) -> Term:
    """The sum of ``terms``; all have one unit."""
    made = terms[0]
    for each in terms[1:]:
        made = made + each
    return made


def weighted(shares: Sequence[Term], of: Sequence[float]) -> Term:
    """Mean molar mass of a mixture with mole fractions ``shares`` [kg/kmol]."""
    return total([x * number(m, "kg/kmol") for x, m in zip(shares, of, strict=True)])
