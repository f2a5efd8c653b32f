"""Building blocks of process models: an engineer writes down what a plant is made of, and a model follows from it."""

from homeostat.process.blocks.equipment import (
    arrhenius,
    centrifugal_flow,
    counter_current,
    equal_percentage_valve,
    exchanged,
    heater,
    linear_valve,
    overflow,
    pump_flow,
    valve_flow,
)
from homeostat.process.blocks.exchanger import Exchanger
from homeostat.process.blocks.flowsheet import Flowsheet
from homeostat.process.blocks.given import FlowsheetError
from homeostat.process.blocks.parts import Actuator, Law
from homeostat.process.blocks.term import Term, exp, limited, log, maximum, minimum, number, sqrt, term, where
from homeostat.process.blocks.vessel import Vessel

__all__ = [
    "Actuator",
    "Exchanger",
    "Flowsheet",
    "FlowsheetError",
    "Law",
    "Term",
    "Vessel",
    "arrhenius",
    "centrifugal_flow",
    "counter_current",
    "equal_percentage_valve",
    "exchanged",
    "exp",
    "heater",
    "limited",
    "linear_valve",
    "log",
    "maximum",
    "minimum",
    "number",
    "overflow",
    "pump_flow",
    "sqrt",
    "term",
    "valve_flow",
    "where",
]
