"""Two heat exchangers in a row: E1 heats what V1 feeds with waste water, which V2 lets in, and E2 with oil, by V3.

Both sides of an exchanger are stirred (`homeostat.process.blocks.exchanger`), with C = cp F the heat capacity flow
[kW/K], K the heat capacity of what a side holds [kJ/K] and UA in kW/K (cell method, Gaddis and Schlünder 1979):

    K_h dT_h/dt = C_h (T_h,in - T_h) - UA (T_h - T_c)
    K_c dT_c/dt = C_c (T_c,in - T_c) + UA (T_h - T_c)

Valves are linear at a constant pressure drop (IEC 60534-2-1). Without a feed the basic control closes the oil valve.
What leaves E2 colder than T_least is no product.
By hand: 0.5 kg/s of water is C = 2.09 kW/K, so from 15 to 45 degC takes 62.7 kW, and on to 80 degC 73.15 kW. E1 has
62.7 / 8 = 7.8 K between its outlets, so the water leaves it at 52.8 degC and V2 lets in 62.7 / (4.18 (98 - 52.8)) =
0.332 kg/s. E2 has 48.8 K, the oil leaves it at 128.8 degC and V3 lets in 73.15 / (2.2 (200 - 128.8)) = 0.467 kg/s.
"""

from homeostat.process.blocks import Exchanger, Flowsheet, linear_valve, where

train = Flowsheet()
e1, e2 = (Exchanger(train, name, ua=f"UA_{name}", start="start", cells=1) for name in ("E1", "E2"))
feed = linear_valve("flow_V1", train.loop("FIC1", measured="F1", drives="V1", acts=-1).opening)
waste = linear_valve("flow_V2", train.loop("TIC1", measured="T1", drives="V2", acts=-1).opening)
fed = train.sensor("F1", feed, relative=True)
heating = train.controller("TIC2", measured="T2", acts=-1).output
oil = linear_valve("flow_V3", train.actuator("V3", where(fed > "F_low", heating, 0.0)).opening)
e1.hot(waste * "cp", "T_waste", "held_water")
e2.hot(oil * "cp_oil", "T_oil", "held_oil")
e1.cold(feed * "cp", "T_feed", "held_water")
e2.cold(feed * "cp", e1.cold_out, "held_water")
for name, temperature in {"T1": e1.cold_out, "T2": e2.cold_out, "T3": e1.hot_out, "T4": e2.hot_out}.items():
    train.sensor(name, temperature)
for name, flow in {"F2": waste, "F3": oil}.items():
    train.sensor(name, flow, relative=True)
for actuator in train.actuators.values():
    train.sensor(f"{actuator.name}_pos", actuator.position)
train.total("pasteurised", "kg", where(e2.cold_out >= "T_least", feed, 0.0))
