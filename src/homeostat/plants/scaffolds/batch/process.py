"""A batch: V1 fills B1, hot water through V2 heats it, and P1 and P2 pump it out, or one of them alone.

A string is the symbol of a row in engineering/parameters.csv: numbers are changed there, and only what the plant is
made of is changed here. The phases are rows of states.csv, what ends each of them is a row of transitions.csv with
`decision` = no, and what is open meanwhile stands in setpoints.csv. In this order: equipment.csv and instruments.csv
(what there is, what measures it), this file, parameters.csv, then the phases. After each step, `homeostat plant check`
says what does not fit.
"""

from homeostat.process.blocks import Flowsheet, Vessel, exchanged, linear_valve, overflow, pump_flow

vessel = Flowsheet()

# The vessel, and what it holds.
b1 = Vessel(vessel, "B1", "L", "start")
t1 = b1.heated("T_feed", "cp")

# Without a loop an actuator does what the phase commands.
feed = linear_valve("flow_V1", vessel.actuator("V1").opening)
hot_water = linear_valve("flow_V2", vessel.actuator("V2").opening)
pumped = pump_flow("flow_P1", vessel.actuator("P1").opening) + pump_flow("flow_P2", vessel.actuator("P2").opening)

# Balances: what comes in, what heats, what goes out. Twice the hot water gives twice the heat.
b1.feed(feed, "T_feed")
product = b1.draw(pumped)
b1.heat(exchanged("UA", "T_hot", t1) * hot_water / "flow_V2")
b1.draw(overflow(b1.volume, "brim", "spill"))
made = vessel.total("product", "L", product)

# Instruments: one line for each row of instruments.csv; `relative` where noise and bias are shares of the reading.
for name, measured in {"L1": b1.volume, "T1": t1, "Q1": made}.items():
    vessel.sensor(name, measured)
for name, flow in {"F1": feed, "F2": product, "F3": hot_water}.items():
    vessel.sensor(name, flow, relative=True)
for actuator in vessel.actuators.values():
    vessel.sensor(f"{actuator.name}_pos", actuator.position)
