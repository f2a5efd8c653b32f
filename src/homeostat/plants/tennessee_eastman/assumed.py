"""What the model of the Tennessee Eastman plant takes to be simple; a true plant has other laws."""

from __future__ import annotations

from homeostat.process.blocks import Term, number, term


class Assumed:
    """The published plant: straight valves, and coolers whose heat transfer the water's flow does not change."""

    def opened(self, position: Term) -> Term:
        """Share of its full flow that a valve of a feed or a liquid passes in a position [1]."""
        return position

    def film(self, cooler: str, water: Term) -> Term:
        """Heat transfer of a cooler (R, S) [1] at a flow of its water [1], both beside the design's."""
        return term(1.0)

    def given_off(self, vessel: str, warm: Term) -> Term:
        """Heat that a vessel (R, S) at ``warm`` [degC] gives to the air [MJ/h]."""
        return number(0.0, "MJ/h")
