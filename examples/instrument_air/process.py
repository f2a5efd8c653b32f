"""Instrument air: C1 fills the receiver B1, V1 feeds the header B2, V3 vents it, V4 is its consumers, V5 adds nitrogen.

It shows a cascade, a split range, an override and an analyser that shows something new every 20 s only.
"""

from homeostat.process.blocks import Flowsheet, Vessel, limited, linear_valve, maximum, minimum, valve_flow

air = Flowsheet()
b1, b2 = Vessel(air, "B1", "mol", "start_B1"), Vessel(air, "B2", "mol", "start_B2")
oxygen = b2.holds("O2", "1", start="O2_start")
p1, p2 = b1.volume * "RT" / "size_B1", b2.volume * "RT" / "size_B2"

# Override: the compressor takes the smaller output, of what the pressure asks for and what its motor bears.
pressure = air.controller("PIC1", measured="P1", acts=-1)
motor = air.controller("JIC1", measured="J1", acts=-1)
c1 = air.actuator("C1", automatic=minimum(pressure.output, motor.output))

# Split range: above a half of the output the supply opens, below it the vent.
header = air.controller("PIC2", measured="P2", acts=-1)
v1 = air.actuator("V1", automatic=limited(2.0 * header.output - 1.0, 0.0, 1.0))
v3 = air.actuator("V3", automatic=limited(1.0 - 2.0 * header.output, 0.0, 1.0))

# Cascade: the controller of the analyser sets the flow of nitrogen. The outer one comes first.
quality = air.controller("AIC1", measured="A1", acts=1)
nitrogen = air.controller("FIC5", measured="F5", acts=-1, setpoint=quality.output * "flow_V5")
v5 = air.actuator("V5", automatic=nitrogen.output)
v4 = air.loop("FIC4", measured="F4", drives="V4", acts=-1)

pressed = linear_valve("flow_C1", c1.opening)
supply = b1.draw(valve_flow("kv_V1", v1.opening, maximum(p1 - p2, 0.0)))
vent = b2.draw(valve_flow("kv_V3", v3.opening, p2))
demand = b2.draw(valve_flow("kv_V4", v4.opening, p2))
dosed = linear_valve("flow_V5", v5.opening)
for vessel, p in ((b1, p1), (b2, p2)):  # spring valves: nothing below their pressure
    vessel.draw(valve_flow("kv_spring", 1.0, p - f"spring_{vessel.name}"))
b1.feed(pressed)
b2.feed(supply, O2="O2_air")
b2.feed(dosed)

air.sensor("P1", p1)
air.sensor("P2", p2)
air.sensor("J1", pressed * "work" * p1)
air.sensor("A1", oxygen, every_s=20.0)
for name, flow in {"F1": pressed, "F2": supply, "F3": vent, "F4": demand, "F5": dosed}.items():
    air.sensor(name, flow, relative=True)
for actuator in air.actuators.values():
    air.sensor(f"{actuator.name}_pos", actuator.position)
air.total("delivered", "mol", demand)
