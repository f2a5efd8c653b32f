"""Is what the table prices there, and is it priced once and per what it can be?"""

from collections.abc import Mapping
from typing import Final

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.prices import PriceKind
from homeostat.knowledge.store.error import Code, Found
from homeostat.stl.spelling import near_matches

_LACKING: Final[Mapping[PriceKind, tuple[Code, str]]] = {
    PriceKind.STATE: (Code.UNKNOWN_STATE, "state"),
    PriceKind.CRITERION: (Code.UNKNOWN_LIMIT, "soft criterion or envelope"),
    PriceKind.LIMIT: (Code.UNKNOWN_LIMIT, "hard limit"),
}


def prices(plant: PlantDescription) -> Found:
    """Prices of what the plant does not have, or has in another way, and second prices of product or release."""
    known = {
        PriceKind.STATE: [state.name for state in plant.machine.states],
        PriceKind.CRITERION: [rule.name for rule in plant.limits.priced],
        PriceKind.LIMIT: [limit.name for limit in plant.limits.hard],
    }
    seen: set[PriceKind] = set()
    for price in plant.prices:
        thing = f"price of {price.kind} {price.subject!r}"
        if price.kind not in known:
            if price.kind in seen:
                yield Code.DUPLICATE_ID, thing, f"is a second price of {price.kind}; keep one row"
            seen.add(price.kind)
        elif price.subject not in known[price.kind]:
            code, what = _LACKING[price.kind]
            hint = near_matches(price.subject, known[price.kind])
            yield code, thing, f"there is no {what} {price.subject!r}{hint}; correct it or remove the row"
