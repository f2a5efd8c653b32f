"""Hydraulic skid: P2 fills the accumulator B1, V2 supplies the consumer, V3 relieves to the tank."""

from homeostat.process.blocks import Flowsheet, Vessel, linear_valve, valve_flow

skid = Flowsheet()
b1 = Vessel(skid, "B1", "L", "start")
p = b1.volume * "stiff"
pump = skid.loop("PIC1", measured="p1", drives="P2", acts=-1)
consumer = skid.loop("FIC2", measured="F2", drives="V2", acts=-1)
relief = skid.loop("PIC3", measured="p3", drives="V3", acts=1)
b1.feed(filled := linear_valve("flow_P2", pump.opening))
supplied = b1.draw(valve_flow("kv_V2", consumer.opening, p))
relieved = b1.draw(valve_flow("kv_V3", relief.opening, p))
skid.sensor("p1", p)
skid.sensor("p3", p)
for name, flow in {"F1": filled, "F2": supplied, "F3": relieved}.items():
    skid.sensor(name, flow, relative=True)
for actuator in skid.actuators.values():
    skid.sensor(f"{actuator.name}_pos", actuator.position)
skid.total("delivered", "L", supplied)
