"""The Tennessee Eastman plant, put together from its vessels, flows, control and instruments.

A (stream 1), D (2), E (3), the recycle (8) and what the stripper gives off (5) meet in the header, which feeds the
reactor (6); what leaves that (7) is cooled, and parted in the separator into the recycle, the purge (9) and a liquid
(10), from which A and C (4) strip what is light before the product (11) leaves. See Downs and Vogel (1993).
"""

from __future__ import annotations

from typing import Final

from homeostat.plants.tennessee_eastman import flows
from homeostat.plants.tennessee_eastman.assumed import Assumed
from homeostat.plants.tennessee_eastman.control import controlled
from homeostat.plants.tennessee_eastman.instruments import (
    GAS_S,
    PRODUCT_S,
    STANDARD,
    analyser,
    gauge,
    level,
    transmitters,
)
from homeostat.plants.tennessee_eastman.reaction import reactions
from homeostat.plants.tennessee_eastman.streams import HOUR, liquid, shared, vapour
from homeostat.plants.tennessee_eastman.substances import BTU, LB, MASS, weighted
from homeostat.plants.tennessee_eastman.vessels import ZERO, Drum, Header, Held, Sump
from homeostat.process.blocks import Flowsheet, Term, number, term

_REACTOR: Final = Held(
    (10.40491389, 4.363996017, 7.570059737, 0.4230042431, 24.15513437, 2.942597645, 154.3770655, 159.186596),
    120.40000000,
)
_SEPARATOR: Final = Held(
    (63.75581199, 26.74026066, 46.38532432, 0.2464521543, 15.20484404, 1.852266172, 52.44639459, 41.20394008),
    80.10940226,
)
_SUMP: Final = Held(
    (0.4306056376, 0.0079906200783, 0.9056036089, 0.016054258216, 0.7509759687, 0.088582855955, 48.27726193, 39.38459),
    65.73102903,
)
_HEADER: Final = Held(
    (107.7562698, 29.77250546, 88.32481135, 23.03929507, 62.85848794, 5.546318688, 11.92244772, 5.555448243),
    86.12011494,
)
_NOTHING: Final = [ZERO] * 8
_NO_HEAT: Final = ZERO


def _feed(flow: Term, **shares: Term | float) -> list[Term]:
    """Flows of the substances [kmol/h] in a feed."""
    return shared([term(shares.get(name, 0.0)) for name in "ABCDEFGH"], flow)


def plant(laws: Assumed) -> Flowsheet:
    """The plant with its basic control and ``laws``."""
    # Its gas follows the flows within 1.8 s, D in little liquid within 0.3 s; without control it runs away in an hour.
    s = Flowsheet(fastest_s=0.25, replayed="setpoints")
    valve = controlled(s)
    r, d = Drum(s, "R", _REACTOR, 1300.0), Drum(s, "S", _SEPARATOR, 3500.0)
    c, h = Sump(s, "C", _SUMP), Header(s, "H", _HEADER, 5000.0)
    water_r = s.state("R_water", "degC", 94.59927549)
    water_s = s.state("S_water", "degC", 77.29698353)
    a, b = s.disturbance("A_in_4"), s.disturbance("B_in_4")
    hot = {name: s.disturbance(f"T_feed_{name}") for name in ("1", "2", "3", "4")}
    rich = s.fault("B_rich")
    a, b = a - s.fault("A_poor") - 0.487438 * rich, b + rich
    d_open, e_open, a_open, c_open = (laws.opened(valve[i].opening) for i in (1, 2, 3, 4))
    f1, f2, f3 = a_open * "most_1" * (1.0 - s.fault("A_lost")), d_open * "most_2", e_open * "most_3"
    f4 = c_open * "most_4" * (1.0 - s.fault("C_header"))
    one = vapour(_feed(f1, A=0.9999, B=0.0001), hot["1"])
    two = vapour(_feed(f2, B=0.0001, D=0.9999), hot["2"] + s.fault("D_hot"))
    three = vapour(_feed(f3, E=0.9999, F=0.0001), hot["3"])
    four = vapour(_feed(f4, A=a, B=b, C=1.0 - a - b), hot["4"])
    six = vapour(shared(h.y, flows.through(1937.6, h.p - r.p, h.mass)), h.t)
    seven = vapour(shared(r.y, flows.through(4574.21, r.p - d.p, r.mass) * "vapour_7"), r.t)
    machine = flows.compressed(valve[5].opening, d, h)
    eight, nine = (vapour(shared(d.y, f), d.t) for f in (machine.flow, flows.purged(valve[6].opening, d)))
    ten = liquid(flows.drawn(laws.opened(valve[7].opening), term("most_10"), d), d.t)
    five, fallen = flows.stripped(four, ten, c)
    eleven = liquid(flows.drawn(laws.opened(valve[8].opening), term("most_11"), c), c.t)
    cold_r, cold_s = valve[10].opening * "water_R", valve[11].opening * "water_S"
    made, heat = reactions(r, term("k1"), term("k2"))
    q_r = term("UA_R") * laws.film("R", cold_r / 0.4111) * flows.reactor_cooling(r, valve[12].opening, water_r)
    q_s = term("UA_S") * laws.film("S", cold_s / 0.1811) * flows.condenser_cooling(seven.flow, r, water_s)
    steam = term("warming_C") * flows.steamed(valve[9].opening, c)
    r.balance([six], [seven], heat + q_r - laws.given_off("R", r.t), made)
    d.balance([seven], [eight, nine, ten], q_s - machine.work - laws.given_off("S", d.t), _NOTHING)
    c.balance([fallen], [eleven], steam + four.heat + ten.heat - five.heat - fallen.heat, _NOTHING)
    h.balance([one, two, three, five, eight], [six], machine.work, _NOTHING)
    inlet_r = s.disturbance("T_water_R") + s.fault("R_water_hot")
    inlet_s = s.disturbance("T_water_S") + s.fault("S_water_hot")
    s.rate(water_r, flows.cooling(cold_r, 1000.0, 7060.0, inlet_r, water_r, q_r) / HOUR)
    s.rate(water_s, flows.cooling(cold_s, 1200.0, 11138.0, inlet_s, water_s, q_s) / HOUR)
    transmitters(s, {
        "F1": f1 * STANDARD, "F2": f2 * weighted([ZERO, term(0.0001), ZERO, term(0.9999)], MASS[:4]),
        "F3": f3 * (0.9999 * number(MASS[4], "kg/kmol") + 0.0001 * number(MASS[5], "kg/kmol")),
        "F4": f4 * STANDARD, "F8": eight.flow * STANDARD, "F6": six.flow * STANDARD,
        "PR": gauge(r.p), "LR": level(r.liquid, 84.6, 666.7), "TR": r.t, "F9": nine.flow * STANDARD,
        "TS": d.t, "LS": level(d.liquid, 27.5, 290.0), "PS": gauge(d.p), "F10": ten.flow / d.density,
        "LC": level(c.liquid, 78.25, 156.5), "PC": gauge(h.p), "F11": eleven.flow / c.density, "TC": c.t,
        "FS": steam * number(1040.0 * LB / BTU, "kg/MJ"), "JK": machine.work / HOUR * number(1000.0, "kJ/MJ"),
        "TWR": water_r, "TWS": water_s,
    })  # fmt: skip
    feed = analyser(s, "6", "ABCDEF", h.y, GAS_S)
    analyser(s, "9", "ABCDEFGH", d.y, GAS_S)
    analyser(s, "11", "DEFGH", c.x, PRODUCT_S)
    s.sensor("yA", feed["A"] / (feed["A"] + feed["C"]) * number(100.0, "%"), every_s=GAS_S)
    s.sensor("yAC", feed["A"] + feed["C"], every_s=GAS_S)
    s.sensor("Q11", s.reading("F11"))  # one transmitter, two setpoints: of its valve, and of the index
    s.sensor("Fp", s.controllers["UC11"].output)
    s.sensor("Gp", s.reading("grade") / 100.0)
    s.total("product", "m3", eleven.flow / c.density / HOUR)
    return s


TENNESSEE_EASTMAN = plant(Assumed())
