"""The reactor: a stirred vessel with jacket, three loops and nine faults, put together from blocks.

A + D -> B with k1 CA CD and A -> C with k2 CA [mol/(L s)]; ``homeostat.process.blocks.vessel`` has the balances. Flows
are those of the positions and the volume at the start of a second. Nothing is divided by less than 0.1 L (feed, jacket)
or 1 L (loss to the ambient), as in the published model. With ``published_balance`` = 1 the species follow the published
form (F1/V) C_feed - (Fo/V) C + r, which does not conserve matter while V changes.

Hand check: F1 = 1/30 L/s, UA u = 500 * 0.5076 W/K gives T = (4180 F1 350 + 290 UAu + 50 300)/(4180 F1 + UAu + 50)
= 310.0 K in steady state (reaction heat, 2.7 W of 5573 W, neglected).
"""

from homeostat.process.blocks import (
    Actuator,
    Flowsheet,
    Law,
    Term,
    Vessel,
    arrhenius,
    exchanged,
    limited,
    linear_valve,
    maximum,
    minimum,
    number,
    overflow,
    pump_flow,
    term,
    where,
)

GAS = number(8.314, "J/(mol K)")
"""Gas constant as the published model rounds it."""
STARTUP, NORMAL, SHUTDOWN = 0.0, 1.0, 2.0
"""Phases of the basic control system."""
USUAL = {"CA": 0.0187, "CB": 0.0009, "CC": 0.0804, "CD": 0.0491}
"""Concentrations at the design point [mol/L]; no instrument shows them."""


FIRST = (
    "fouling pump_degrade cool_stuck_closed cool_stuck_open outlet_block inlet_stuck_open temp_bias level_bias leak "
    "UA UA_ambient T_ambient cp T_feed T_coolant CA_feed CD_feed k0_AD E_AD k0_A E_A dH_AD dH_A Cv_V1 K_P1 "
    "F3_max tau_V1 tau_P1 tau_V2 tau_XV1 V_brim k_brim tau_fouling Kp_flow Ki_flow Kp_level Ki_level trim_low "
    "feedforward_P1 Kp_temperature Ki_temperature t_startup t_shutdown L_heel sd_CA_feed sd_CD_feed sd_T_feed "
    "tau_feed published_balance sd_T1 sd_L1 rel_F1 rel_F2 rel_F3 sd_T2 sd_T3 sd_ZT bias_T1 bias_L1 bias_F1 "
    "bias_F2 bias_F3 bias_T2 bias_T3 bias_ZT1 bias_ZTP bias_ZT2"
)
"""Faults and parameters in the order in which the plants of recorded runs were drawn."""


class Assumed:
    """What the model takes to be simple; the true plant has other laws."""

    def opened(self, valve: str, position: Term) -> Term:
        """Share of its full flow that ``valve`` passes in a position [1]."""
        return position

    def pumped(self, speed: Term, volume: Term) -> Term:
        """Share of its full flow that the pump moves [1] at a volume in the vessel [L]."""
        return speed

    def cooled(self, opening: Term) -> Term:
        """Share of UA that the jacket has at an opening of its valve [1]."""
        return opening

    def warm(self, sheet: Flowsheet, vessel: Vessel) -> None:
        """What else warms or cools the vessel: nothing."""


def reactor(laws: Assumed) -> Flowsheet:
    """The reactor with ``laws``."""
    s = Flowsheet()
    s.first = tuple(FIRST.split())
    a = s.disturbance("CA_feed", sd="sd_CA_feed", tau="tau_feed")
    d = s.disturbance("CD_feed", sd="sd_CD_feed", tau="tau_feed")
    hot, cold = s.disturbance("T_feed", sd="sd_T_feed", tau="tau_feed"), s.disturbance("T_coolant")
    r = Vessel(s, "", "L", 0.0, leak=number(0.0, "L/s"))
    held = {name: r.holds(name, "mol/L", usual=usual) for name, usual in USUAL.items()}
    t = r.heated("T_feed", "cp")
    s.parts = where(r.volume > 2.0, 1.0, where(r.volume > 0.5, 8.0, 32.0))  # smaller steps while it is nearly empty
    s.sensor("T1", t, off=s.fault("temp_bias"))
    level = s.sensor("L1", r.volume, off=-s.fault("level_bias"))
    dry, empty = s.switch("dry", r.volume <= 0.01), s.switch("empty", r.volume <= 0.1)
    v1, p1, v2 = _control(s, level, dry, empty)
    feed = s.hold("feed", linear_valve("Cv_V1", laws.opened("V1", v1.opening)) * s.actuator("XV1", start=1.0).position)
    r.feed(feed, hot, CA=a, CD=d)
    r.release(s.hold("leak", minimum(s.fault("leak"), 1.0) * r.volume))
    r.release(s.hold("overflow", overflow(r.volume, "V_brim", "k_brim")))
    moved = pump_flow("K_P1", laws.pumped(p1.opening, r.volume)) * (1.0 - s.fault("outlet_block"))
    there = maximum(r.volume / number(1.0, "s") + feed - r.outflow, 0.0)  # without suction a pump moves no more
    out = r.release(s.hold("drawn", minimum(moved, there)))
    s.total("product", "L", out)
    opened = laws.opened("V2", v2.opening)
    s.sensor("F1", feed, relative=True, errors=("bias_F1", "rel_F1"))
    s.sensor("F2", out, relative=True, errors=("bias_F2", "rel_F2"))
    s.sensor("F3", linear_valve("F3_max", opened), relative=True, errors=("bias_F3", "rel_F3"))
    s.sensor("T2", hot)
    s.sensor("T3", cold)
    for valve, symbol in ((v1, "bias_ZT1"), (p1, "bias_ZTP"), (v2, "bias_ZT2")):
        s.sensor(f"{valve.name}_zt", valve.position, errors=(symbol, "sd_ZT"))
    r.react(arrhenius("k0_AD", "E_AD", t, GAS) * held["CA"] * held["CD"], "dH_AD", CA=-1, CD=-1, CB=1)
    r.react(arrhenius("k0_A", "E_A", t, GAS) * held["CA"], "dH_A", CA=-1, CC=1)
    thinned = where(number(0.5, "1") < "published_balance", (r.inflow - r.outflow) / r.wet, 0.0)
    for name, concentration in held.items():
        r.react(thinned * concentration, **{name: 1.0})
    ua = s.hold("UA", "UA" * (1.0 - minimum(s.growing("fouling", "tau_fouling"), 0.95)))
    r.heat(-exchanged(ua * laws.cooled(opened), t, cold))
    r.heat(-exchanged("UA_ambient", t, "T_ambient") * r.wet / maximum(r.volume, 1.0))
    laws.warm(s, r)
    return s


def _control(s: Flowsheet, level: Term, dry: Term, empty: Term) -> tuple[Actuator, Actuator, Actuator]:
    """Phases and loops: feed valve, product pump and cooling water valve."""
    begun = (level >= s.setpoint("L1")) | (s.time >= "t_startup")
    phase = s.memory(
        "phase",
        lambda was: where(s.time >= "t_shutdown", SHUTDOWN, where((was <= STARTUP) & begun, NORMAL, was)),
        usual=NORMAL,
    )
    shut = phase >= SHUTDOWN
    flow = s.controller("flow", "F1", acts=-1, law=Law(rests=shut))
    v1 = s.actuator("V1", where(shut, 0.0, flow.output), faults={"stuck_open": "inlet_stuck_open"})
    wild = limited(s.reading("F1") / "feedforward_P1", 0.0, 1.0)
    off = (phase <= STARTUP) | (shut & (dry >= 1.0))
    target = where(shut, "L_heel", s.setpoint("L1"))
    trim = s.controller("level", "L1", acts=1, setpoint=target, law=Law(term("trim_low"), wild, off))
    pumping = limited(wild + trim.output, 0.0, 1.0)
    pump = where(off, 0.0, where(shut, maximum(pumping, 0.05), pumping))
    p1 = s.actuator("P1", pump, faults={"weak": "pump_degrade"})
    cold = shut & (empty >= 1.0)
    cooling = s.controller("temperature", "T1", acts=1, law=Law(rests=cold))
    stuck = {"stuck_open": "cool_stuck_open", "stuck_closed": "cool_stuck_closed"}
    return v1, p1, s.actuator("V2", where(cold, 0.0, cooling.output), faults=stuck)


REACTOR = reactor(Assumed())
