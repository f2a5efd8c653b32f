"""Cost: what a decision gives away, item by item, in the currency of the plant."""

from dataclasses import dataclass

PRODUCT = "production"
"""Name of the item for product that is not made."""
RELEASE = "release"
"""Name of the item for a set of commands that is released."""
KNOWING = "knowing"
"""Name of the item for what knowing more is expected to win, which is less than nothing."""


@dataclass(frozen=True, slots=True)
class CostItem:
    """One thing that costs."""

    name: str
    """Production, a release, a state, or the criterion or limit that is missed."""
    amount: float
    """What it is expected to cost, in the plant's currency."""


@dataclass(frozen=True, slots=True)
class Cost:
    """What a decision is expected to cost over the time that was looked at."""

    items: tuple[CostItem, ...]
    """What it consists of; items of nothing are left out."""
    worth: float
    """What the plant makes in that time by design, in its currency."""

    @property
    def total(self) -> float:
        """All of it, in the plant's currency."""
        return sum(item.amount for item in self.items)

    @property
    def share(self) -> float:
        """All of it as a share of what the plant makes by design [1]: what a hundredth of it is called is a point."""
        return self.total / self.worth
