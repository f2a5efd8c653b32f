"""Prices: what everything that does not forbid costs, in one currency of the plant.

Economic model predictive control judges a decision by a stage cost with slack on soft constraints (Rawlings, Angeli and
Bates, 2012); these are the prices of its terms. Hard limits have one as well: that of a violation, which is what a
probability of it costs.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum

from homeostat.domain.plant.limits import Limits
from homeostat.domain.plant.production import Production
from homeostat.domain.plant.state_machine import StateMachine
from homeostat.domain.plant.timing import REFERENCE, Timing

OUTSIDE = 0.1
"""Share of the design production that one scale outside a soft criterion costs, where nothing is stated [1]."""
STOP_S = 3_600.0
"""Time of design production that violating a hard limit costs where nothing is stated: a stop, and a start, by the
reference [s]."""
RANK = 0.01
"""Share of the design production that each rank of a state's risk costs where nothing is stated [1]."""
RELEASE_S = 9.0
"""Time of design production that a release costs where nothing is stated: somebody has to look at it, by the
reference [s]."""
HOUR_S = 3_600.0
"""One hour [s]."""


class PriceKind(StrEnum):
    """What is priced, and per what."""

    PRODUCT = "product"
    """One unit of what the plant makes."""
    RELEASE = "release"
    """One set of commands that is released."""
    STATE = "state"
    """One hour in a state of the machine."""
    CRITERION = "criterion"
    """One hour at one scale outside a soft criterion or envelope."""
    LIMIT = "limit"
    """One violation of a hard limit."""


@dataclass(frozen=True, slots=True)
class Price:
    """One row of the table of prices."""

    kind: PriceKind
    """What is priced."""
    subject: str
    """Name of the state, criterion or limit; what is made, or ``release``."""
    amount: float
    """The price, in the plant's currency."""


@dataclass(frozen=True, slots=True)
class Prices:
    """Every price of a plant; what no table states follows from the product."""

    production: Production
    """What is made, and how much of it by design."""
    currency: str
    """What prices are in."""
    product: float
    """One unit of product."""
    release: float
    """One release."""
    states: Mapping[str, float]
    """State -> one hour in it."""
    outside: Mapping[str, float]
    """Soft criterion or envelope -> one hour at one scale outside it."""
    violation: Mapping[str, float]
    """Hard limit -> one violation of it."""

    def worth(self, seconds: float) -> float:
        """What the plant makes in so many ``seconds`` by design, in its currency."""
        return self.product * self.production.made(seconds)


def prices_of(
    rows: tuple[Price, ...],
    production: Production,
    currency: str,
    limits: Limits,
    machine: StateMachine,
    timing: Timing = REFERENCE,
) -> Prices:
    """The prices of ``rows``, and for what they leave out what follows from the product and the plant's ``timing``."""
    stated = {(row.kind, row.subject): row.amount for row in rows}
    product = next((row.amount for row in rows if row.kind is PriceKind.PRODUCT), 1.0)
    released = next((row.amount for row in rows if row.kind is PriceKind.RELEASE), None)
    hour = product * production.made(HOUR_S)
    soft = [rule.name for rule in limits.priced]
    hard = [limit.name for limit in limits.hard]
    return Prices(
        production,
        currency,
        product,
        product * production.made(timing.time_s(RELEASE_S)) if released is None else released,
        {s.name: stated.get((PriceKind.STATE, s.name), RANK * s.risk * hour) for s in machine.states},
        {name: stated.get((PriceKind.CRITERION, name), OUTSIDE * hour) for name in soft},
        {name: stated.get((PriceKind.LIMIT, name), product * production.made(timing.time_s(STOP_S))) for name in hard},
    )
