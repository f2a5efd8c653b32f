"""The gate: the only writer to the plant. Default deny; it re-checks at release, latches, and watches."""

from __future__ import annotations

import math
from collections.abc import Mapping

from homeostat.domain.limits import Limits
from homeostat.domain.ports import Plant, Rehearsal
from homeostat.domain.recovery import ActionSet, Command, FallbackStrategy
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Approve, Released, Revise
from homeostat.guard.permissives import permissive_findings, unjudged, usable
from homeostat.guard.sequencer import Sequencer


class Refused(Exception):
    """The gate did not release; the message names the check, the value and the limit."""


class Overtaken(Refused):
    """The plant went on to another state while the release was prepared; what was approved may be found again."""


class Gate:
    """Releases an action set that carries its own approval, or a fallback; nothing else reaches the plant."""

    def __init__(
        self, plant: Plant, limits: Limits, fallback: FallbackStrategy, rehearsal: Rehearsal, sequencer: Sequencer,
        filter_s: float = 20.0,
    ) -> None:  # fmt: skip
        """``fallback`` acts until a better one is armed; ``filter_s`` smooths readings before limits are judged [s].

        It also acts where nobody will be there to take later steps, so it must have none; ValueError where it has.
        ``sequencer`` carries out the later steps of what is released.
        """
        self._plant = plant
        self._sequencer = sequencer
        self._limits = limits
        self._rehearsal = rehearsal
        if fallback.actions.then:
            raise ValueError(
                f"fallback {fallback.name!r} has later steps; the first one must be done when it is written"
            )
        self._armed = self._first = fallback
        self._fell_back, self._seen_s = False, 0.0
        self._gain = 1.0 - math.exp(-1.0 / filter_s)
        self._smooth: dict[str, float] = {}
        self._errors: tuple[Mapping[str, float], ...] = ({},)
        self.latched: str | None = None
        """Why the fallback acted; None while it has not. A latched gate releases nothing more."""

    def arm(self, fallback: FallbackStrategy) -> None:
        """Have ``fallback`` ready; done before anything is proposed."""
        self._armed = fallback

    @property
    def armed(self) -> FallbackStrategy:
        """The fallback that would act now."""
        return self._armed

    async def release(self, actions: ActionSet, approval: Approve, seen_s: float, state: str | None = None) -> Released:
        """Write ``actions`` to the plant; ``seen_s`` is the process time up to which the rehearsal knows the plant.

        ``state``: the one that they start in, where the sequencer may go on meanwhile.

        Raises:
            Overtaken: the sequencer has left ``state``, and nothing else is the matter.
            Refused: the gate is latched, the approval is another action set's, a hard limit cannot be judged or a
                permissive does not hold on a fresh snapshot, or the rollout repeated from there is not approved.
        """
        self._refuse_if_latched()
        if approval.digest != actions.digest:
            raise Refused(f"the approval is not for action set {actions.digest[:12]}; judge that one first")
        fresh = await self._plant.since(seen_s)
        snapshot = fresh[-1]
        self._refuse_if_unfit(snapshot, actions.commands)
        match self._rehearsal.rehearse(fresh, actions):
            case Approve(digest=digest) if digest == actions.digest:
                self._refuse_if_latched()  # the fallback may have acted while the plant was read
                if state is not None and self._sequencer.state != state:
                    raise Overtaken(f"the plant went on from {state!r} to {self._sequencer.state!r} meanwhile")
                self._sequencer.stop()
                await self._plant.write(actions.commands)
                self._sequencer.load(actions, snapshot.at_s)
                return Released(actions, snapshot.at_s)
            case Revise() as revise:
                worst = min(revise.violated, key=lambda f: f.margin, default=None)
                raise Refused(f"rollout from the fresh snapshot: {worst.message if worst else 'no reason is given'}")
            case _:
                raise Refused("the rehearsal approved another action set; nothing is released")

    async def fall_back(self, reason: str, unattended: bool = False) -> FallbackStrategy:
        """Bring the plant to a safe state and latch, even if the plant cannot be reached; safe to call twice.

        Once it was written it is not begun again: its later steps may have been taken. ``unattended``: nobody will be
        there to take later steps, so the first strategy acts, which has none.
        """
        if self.latched is None:
            self.latched = reason
        if self._fell_back and not (unattended and self._sequencer.rest().then):
            return self._armed
        if unattended and self._armed.actions.then:
            self._armed = self._first
        self._sequencer.stop()
        try:
            await self._plant.write(self._armed.actions.commands)
            self._fell_back = True
        finally:
            self._sequencer.load(self._armed.actions, self._seen_s, aborting=True)
        return self._armed

    def correct(self, errors: tuple[Mapping[str, float], ...]) -> None:
        """Take note of instrument errors: one mapping (tag -> reading minus truth) per plausible explanation.

        A limit counts as broken if it is broken under any of them; the readings themselves are among them unless
        the diagnosis rules them out.
        """
        self._errors = errors or ({},)

    def watch(self, snapshot: Snapshot) -> str | None:
        """The hard limit that smoothed readings break or that cannot be judged; None while all hold."""
        readings, self._seen_s = usable(snapshot), snapshot.at_s
        blind = self._blind(readings)
        if blind is not None:
            return blind
        self._follow(readings)
        for errors in self._errors:
            values = {t: v - errors.get(t, 0.0) for t, v in self._smooth.items()}
            for limit in self._limits.hard:
                margin = limit.formula.margin_at(values)
                if math.isnan(margin):
                    return f"{limit.formula.text!r} has no value at these readings ({limit.name})"
                if margin < 0.0:
                    return f"{limit.formula.text!r} is broken by {-margin:.4g} {limit.formula.unit} ({limit.name})"
        return None

    def _follow(self, readings: Mapping[str, float]) -> None:
        for tag, value in readings.items():
            before = self._smooth.get(tag, value)
            self._smooth[tag] = before + self._gain * (value - before)

    def _blind(self, readings: Mapping[str, float]) -> str | None:
        """Which hard limit the readings cannot decide; None where they decide all."""
        return next((b for limit in self._limits.hard if (b := unjudged(limit, readings)) is not None), None)

    def _refuse_if_unfit(self, snapshot: Snapshot, commands: tuple[Command, ...]) -> None:
        blind = self._blind(usable(snapshot))
        if blind is not None:
            raise Refused(f"readings at release: {blind}")
        for finding in permissive_findings(snapshot, commands, self._limits):
            if not finding.satisfied:
                raise Refused(f"permissive at release: {finding.message}")

    def _refuse_if_latched(self) -> None:
        if self.latched is not None:
            raise Refused(f"the gate is latched ({self.latched}); an operator must reset it")
