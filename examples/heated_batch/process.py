"""A heated batch: V1 fills R1, H1 heats it, A reacts to B, V2 lets cooling water into a coil, and V3 empties it.

    dV/dt = F1 - F3
    dA/dt = F1 (A_feed - A) / V - k A,     k = k0 exp(-E / (R T))            first order (Levenspiel 1999, ch. 3)
    dT/dt = F1 (T_feed - T) / V + (P u_H1 - UA u_V2 (T - T_water)) / (cp V)

V in L, A in mol/L, T in degC (in K in k), F in L/s, P in kW, UA in kW/K, cp in kJ/(L K); u is an opening, so that the
coil passes heat as it passes water. Above 100 degC steam takes the heat, UA_vent (T - 100): a model has to stay
physical where nobody acts. Valves are linear (IEC 60534-2-1), and F3 is never more than the vessel gives. What is
delivered is counted in mol of B, A_feed - A in each litre.
By hand: 55 L at 0.5 L/s take 110 s; 60 L from 20 to 70 degC take 60 * 4.18 * 50 / 40 = 313.5 s; at 70 degC
k = 0.0150 1/s, so from 1 to 0.1 mol/L takes ln(10) / k = 153 s; and cooling from 70 to 35 degC with 15 degC of water
takes 60 * 4.18 / 2.5 * ln(55 / 20) = 101 s.
"""

from homeostat.process.blocks import Flowsheet, Vessel, arrhenius, exchanged, heater, linear_valve, maximum

batch = Flowsheet(parts=2)
r1 = Vessel(batch, "R1", "L", "heel", heel=1.0)
t, a = r1.heated("T_feed", "cp", unit="degC"), r1.holds("A", "mol/L")
h1 = batch.loop("TIC1", measured="T1", drives="H1", acts=-1)
v1, v2, v3 = (batch.actuator(name) for name in ("V1", "V2", "V3"))
feed = linear_valve("flow_V1", v1.opening)
product = r1.draw(linear_valve("flow_V3", v3.opening))
r1.feed(feed, "T_feed", A="A_feed")
r1.react(arrhenius("k0", "E_A", t + 273.15) * a, A=-1)
r1.heat(heater("power_H1", h1.opening))
r1.heat(-1.0 * exchanged("UA_vent", maximum(t, "T_boil"), "T_boil"))
r1.heat(-v2.opening * exchanged("UA", t, "T_water"))
made = batch.total("delivered", "mol", product * ("A_feed" - a))
for name, measured in {"L1": r1.volume, "T1": t, "A1": a, "made": made}.items():
    batch.sensor(name, measured)
for name, flow in {"F1": feed, "F3": product}.items():
    batch.sensor(name, flow, relative=True)
for actuator in batch.actuators.values():
    batch.sensor(f"{actuator.name}_pos", actuator.position)
