"""Neutralisation: V1 feeds acid water into B1, P1 doses caustic and P2 acid, V2 discharges, V3 dumps into a basin."""

from homeostat.process.blocks import (
    Flowsheet,
    Vessel,
    limited,
    linear_valve,
    log,
    overflow,
    pump_flow,
    sqrt,
    term,
    valve_flow,
)

plant = Flowsheet()
b1, b2 = Vessel(plant, "B1", "L", "start"), Vessel(plant, "B2", "L", "start_B2")
ions = plant.state("ions", "mmol", start=0.0)  # net charge of what is in B1: negative where it is acid
charge = ions / b1.wet
x = charge / term("buffer") * 2.0
ph = 7.0 + log(x + sqrt(x * x + 1.0)) / 2.302585
v1 = plant.loop("FIC1", measured="F1", drives="V1", acts=-1)
v2 = plant.loop("LIC1", measured="L1", drives="V2", acts=1)
share = plant.reading("F1") * "ratio" + 0.5  # the middle of the split range, and what the feed needs
dosing = plant.controller("QIC1", measured="PH1", acts=-1, forward=share)
p1 = plant.actuator("P1", automatic=limited(2.0 * dosing.output - 1.0, 0.0, 1.0))
p2 = plant.actuator("P2", automatic=limited(1.0 - 2.0 * dosing.output, 0.0, 1.0))
v3 = plant.actuator("V3")
feed = linear_valve("flow_V1", v1.opening)
discharge = b1.draw(valve_flow("kv_V2", v2.opening, b1.volume))
dumped = b1.draw(valve_flow("kv_V3", v3.opening, b1.volume))
base, acid = pump_flow("flow_P1", p1.opening), pump_flow("flow_P2", p2.opening)
for flow in (feed, base, acid):
    b1.feed(flow)
b1.draw(overflow(b1.volume, "brim", "spill"))
plant.rate(ions, feed * "charge_feed" + base * "charge_base" + acid * "charge_acid" - b1.outflow * charge)
b2.feed(dumped)
b2.draw(overflow(b2.volume, "brim_B2", "spill"))
plant.sensor("L1", b1.volume)
plant.sensor("L2", b2.volume)
plant.sensor("PH1", plant.lag("probe", ph, "tau_probe"))
for name, flow in {"F1": feed, "F2": discharge, "F3": dumped}.items():
    plant.sensor(name, flow, relative=True)
for actuator in plant.actuators.values():
    plant.sensor(f"{actuator.name}_pos", actuator.position)
plant.total("discharged", "L", discharge)
