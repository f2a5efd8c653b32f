"""The price list: what a model that is to find what costs least is told of prices, and of what doing nothing costs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from homeostat.agents.language.price_list import MOST_ITEMS, MOST_PRICED, cost_text, price_list
from homeostat.domain.cost import PRODUCT, Cost, CostItem
from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.prices import Price, PriceKind, Prices, prices_of
from homeostat.domain.plant.production import Production
from homeostat.llm.tokens import estimate
from homeostat.plants.plant import load_plant
from tests.safety.world import CALM, COLD, FEED, HOT, MACHINE, criterion

LIMITS = Limits((HOT, COLD, FEED), (CALM, criterion("WARM", "T <= 310")))
PRICED = (
    Price(PriceKind.CRITERION, "WARM", 24.0),
    Price(PriceKind.STATE, "running", 0.0),
    Price(PriceKind.STATE, "emptying", 6.0),
    Price(PriceKind.STATE, "still", 6.0),
)


def prices(*rows: Price, limits: Limits = LIMITS) -> Prices:
    return prices_of(rows, Production("F", 1.0 / 30.0), "EUR", limits, MACHINE)


def test_everything_that_has_a_price_is_told_with_its_unit_and_its_rule() -> None:
    assert price_list(prices(*PRICED), LIMITS, {"K": 2.0}) == (
        "Costs in EUR: F at its design of 0.03333 is worth 120 an hour; a release costs 0.3; "
        "an hour in a state: 6 emptying or still; "
        "an hour outside: 24 per 2 K outside WARM (T <= 310); 12 per 2 K outside LIM-COLD (T >= 298)."
    )


def test_what_forbids_has_no_price_in_it() -> None:
    text = price_list(prices(), LIMITS, {})
    assert not any(name in text for name in ("LIM-HOT", "PRM-FEED", "ACC-CALM"))


def test_where_nothing_is_soft_and_no_state_costs_anything_nothing_is_told_of_them() -> None:
    free = replace(prices(limits=Limits((HOT,), ())), states=dict.fromkeys(("running", "still"), 0.0))
    assert price_list(free, Limits((HOT,), ()), {}).endswith("; a release costs 0.3.")


def test_there_is_an_end_to_the_list_and_the_dearest_come_first() -> None:
    many = Limits((), tuple(criterion(f"C-{k}", f"T <= {300 + k}") for k in range(30)))
    rows = tuple(Price(PriceKind.CRITERION, f"C-{k}", 1.0 + k) for k in range(30))
    text = price_list(prices(*rows, limits=many), many, {})
    assert text.count(" outside C-") == MOST_PRICED
    assert text.index("C-29 ") < text.index("C-28 ") and "C-23 " not in text


@pytest.mark.parametrize("name", ["cstr", "mixing_module"])
def test_a_plant_s_list_leaves_room_for_the_plant(name: str) -> None:
    plant = load_plant(name)
    text = price_list(plant.prices, plant.description.limits, plant.description.scales)
    assert text.startswith("Costs in EUR: ") and "\n" not in text and estimate(text) < 300


def test_what_doing_nothing_costs_is_told_with_its_dearest_items() -> None:
    cost = Cost((CostItem(PRODUCT, 1.0), CostItem("WARM", 5.25)), 30.0)
    assert cost_text(cost, "EUR") == (
        "Without action it costs 6.25 EUR (20.8 % of full production): WARM 5.25, production 1."
    )
    assert cost_text(Cost((), 30.0), "EUR") == "Without action it costs 0 EUR (0 % of full production)."
    assert cost_text(None, "EUR") == ""
    many = Cost(tuple(CostItem(f"C-{k}", float(k)) for k in range(30)), 30.0)
    assert cost_text(many, "EUR").count("C-") == MOST_ITEMS and "C-29 29, C-28 28" in cost_text(many, "EUR")
