"""A buffer with two pumps: V1 feeds B1, P1 and P2 pump into one header, and V2 lets the consumer draw from it.

Equations, with volumes in L, pressures above that of the buffer in bar, flows in L/s:

    pump (quadratic curve, affinity laws)      p = H0 n^2 - k F^2, a check valve lets nothing back
    valve V2 (IEC 60534-2-1, linear)           F2 = Kv u sqrt(p)
    header (pressure vessel with a membrane)   C dp/dt = F_P1 + F_P2 - F2
    buffer                                     dV/dt = F1 - F_P1 - F_P2

One controller holds the pressure with both pumps, so each carries the other's load when it fails: there is no standby
whose failure nobody sees. Gülich, Centrifugal Pumps (2014), 11.6, parallel operation.
By hand: at 4 bar and 0.5 L/s each pump gives 0.25 L/s at n = sqrt((4 + 4 * 0.25^2) / 6) = 0.842, and V2 is open by
0.5 / (0.6 sqrt(4)) = 0.417. One pump at full speed alone gives 0.5 L/s at 6 - 4 * 0.5^2 = 5 bar.
"""

from homeostat.process.blocks import Flowsheet, Vessel, centrifugal_flow, linear_valve, overflow, valve_flow

station = Flowsheet(parts=4)
b1, p = Vessel(station, "B1", "L", "start"), station.state("header", "bar", "start_p", least=0.0)
feed = linear_valve("flow_V1", station.loop("LIC1", measured="L1", drives="V1", acts=-1).opening)
pressure = station.controller("PIC1", measured="p", acts=-1).output
pumps = [station.actuator(name, pressure) for name in ("P1", "P2")]
flows = [b1.draw(centrifugal_flow(("head", "steepness"), pump.opening, p)) for pump in pumps]
drawn = valve_flow("Kv_V2", station.loop("FIC2", measured="F2", drives="V2", acts=-1).opening, p)
b1.feed(feed)
b1.draw(overflow(b1.volume, "brim", "spill"))
station.rate(p, (flows[0] + flows[1] - drawn) / "capacity")
station.sensor("L1", b1.volume)
station.sensor("p", p)
for name, flow in {"F1": feed, "F2": drawn, "F3": flows[0], "F4": flows[1]}.items():
    station.sensor(name, flow, relative=True)
for actuator in station.actuators.values():
    station.sensor(f"{actuator.name}_pos", actuator.position)
station.total("delivered", "L", drawn)
