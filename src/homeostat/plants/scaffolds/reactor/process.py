"""A stirred vessel: V1 feeds R1, where A becomes B and heats it; V2 cools its jacket J1, and P1 pumps the product out.

A string is the symbol of a row in engineering/parameters.csv: numbers are changed there, and only what the plant is
made of is changed here. In this order: equipment.csv and instruments.csv (what there is, what measures it), this file,
parameters.csv, then setpoints.csv and limits.csv. After each step, `homeostat plant check` says what does not fit.
"""

from homeostat.process.blocks import Flowsheet, Vessel, arrhenius, exchanged, linear_valve, overflow, pump_flow

reactor = Flowsheet()

# The vessel, and what it holds. A second product is one more holds(...), and one more factor in react(...).
r1 = Vessel(reactor, "R1", "L", "start")
t1 = r1.heated("T_start", "cp")
a = r1.holds("A", "mol/L", "A_start")
r1.holds("B", "mol/L")

# Three loops: what they hold, what they drive; acts is 1 where more of what is measured needs more output, else -1.
feed = linear_valve("flow_V1", reactor.loop("FIC1", measured="F1", drives="V1", acts=-1).opening)
product = r1.draw(pump_flow("flow_P1", reactor.loop("LIC1", measured="L1", drives="P1", acts=1).opening))
coolant = linear_valve("flow_V2", reactor.loop("TIC1", measured="T1", drives="V2", acts=1).opening)

# The jacket is a vessel, too: as much comes in as goes out.
j1 = Vessel(reactor, "J1", "L", "V_jacket")
t2 = j1.heated("T_coolant", "cp")
j1.feed(coolant, "T_coolant")
j1.draw(coolant)

# What comes in, what reacts, and what goes through the wall. `R1_fouled` is a fault of faults.csv: a part of the wall.
r1.feed(feed, "T_feed", A="A_feed")
r1.react(arrhenius("k0", "E", t1) * a, "dH", A=-1, B=1)
through = exchanged("UA", t1, t2) * (1.0 - reactor.fault("R1_fouled"))
r1.heat(-through)
j1.heat(through)
r1.draw(overflow(r1.volume, "brim", "spill"))

# Instruments: one line for each row of instruments.csv; `relative` where noise and bias are shares of the reading.
for name, measured in {"L1": r1.volume, "T1": t1, "T2": t2, "A1": a}.items():
    reactor.sensor(name, measured)
for name, flow in {"F1": feed, "F2": product, "F3": coolant}.items():
    reactor.sensor(name, flow, relative=True)
for actuator in reactor.actuators.values():
    reactor.sensor(f"{actuator.name}_pos", actuator.position)

reactor.total("product", "L", product)
