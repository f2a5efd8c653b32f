"""Two tanks in series: V1 feeds B1, P1 pumps into B2, which H1 heats, and P2 pumps out."""

from homeostat.process.blocks import Flowsheet, Vessel, heater, linear_valve, overflow, pump_flow

tanks = Flowsheet()
b1, b2 = Vessel(tanks, "B1", "L", "start"), Vessel(tanks, "B2", "L", "start")
t1, t2 = b1.heated("T_feed", "cp"), b2.heated("T_feed", "cp")
feed = linear_valve("flow_V1", tanks.loop("FIC1", measured="F1", drives="V1", acts=-1).opening)
middle = b1.draw(pump_flow("flow_P1", tanks.loop("LIC1", measured="L1", drives="P1", acts=1).opening))
product = b2.draw(pump_flow("flow_P2", tanks.loop("LIC2", measured="L2", drives="P2", acts=1).opening))
b1.feed(feed, "T_feed")
b2.feed(middle, t1)
b2.heat(heater("power_H1", tanks.loop("TIC2", measured="T2", drives="H1", acts=-1).opening))
spilled = b1.draw(overflow(b1.volume, "brim", "spill")) + b2.draw(overflow(b2.volume, "brim", "spill"))
for name, measured in {"L1": b1.volume, "L2": b2.volume, "T1": t1, "T2": t2}.items():
    tanks.sensor(name, measured)
for name, flow in {"F1": feed, "F2": middle, "F3": product}.items():
    tanks.sensor(name, flow, relative=True)
for actuator in tanks.actuators.values():
    tanks.sensor(f"{actuator.name}_pos", actuator.position)
tanks.total("product", "L", product)
