"""A heated tank: V1 feeds B1, H1 heats it, and P1 pumps the product out.

A string is the symbol of a row in engineering/parameters.csv: numbers are changed there, and only what the plant is
made of is changed here. In this order: equipment.csv and instruments.csv (what there is, what measures it), this file,
parameters.csv, then setpoints.csv and limits.csv. After each step, `homeostat plant check` says what does not fit.
"""

from homeostat.process.blocks import Flowsheet, Vessel, heater, linear_valve, overflow, pump_flow

tank = Flowsheet()

# Vessels: what is in them. A second one is `b2 = Vessel(tank, "B2", "L", "start")`, fed with what b1.draw(...) gives.
b1 = Vessel(tank, "B1", "L", "start")
t1 = b1.heated("T_feed", "cp")

# Loops: what they hold, what they drive; acts is 1 where more of what is measured needs more output, else -1.
feed = linear_valve("flow_V1", tank.loop("FIC1", measured="F1", drives="V1", acts=-1).opening)
product = b1.draw(pump_flow("flow_P1", tank.loop("LIC1", measured="L1", drives="P1", acts=1).opening))
power = heater("power_H1", tank.loop("TIC1", measured="T1", drives="H1", acts=-1).opening)

# Balances: what comes in, what heats, what is lost.
b1.feed(feed, "T_feed")
b1.heat(power)
b1.draw(overflow(b1.volume, "brim", "spill"))

# Instruments: one line for each row of instruments.csv; `relative` where noise and bias are shares of the reading.
tank.sensor("L1", b1.volume)
tank.sensor("T1", t1)
tank.sensor("F1", feed, relative=True)
tank.sensor("F2", product, relative=True)
for actuator in tank.actuators.values():
    tank.sensor(f"{actuator.name}_pos", actuator.position)

tank.total("product", "L", product)
