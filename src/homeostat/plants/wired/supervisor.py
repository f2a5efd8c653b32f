"""Guard and recovery for one plant, as a caller from Python wants them: a plant, a link, one call."""

import math

from homeostat.domain.mode import Mode, PersonCommand
from homeostat.domain.ports import Clock, Link
from homeostat.journal import MemoryTrace, Trace
from homeostat.links.clock import ThinkingClock
from homeostat.llm.model import LanguageModel
from homeostat.plants.plant import Plant
from homeostat.plants.wired.assembly import Arrangement, Language, wire
from homeostat.recovery.exchange.loop import Hook

_LINK, _SOURCE = ("source", "take", "beat", "give_back"), ("now_s", "ended", "never_blocks", "advance")
"""What a link and its source must have."""


class Supervisor:
    """Watches one plant, and recovers it as far as its mode allows: ``Supervisor(plant, link).run()``."""

    def __init__(
        self,
        plant: Plant,
        link: Link,
        mode: Mode = Mode.OBSERVE,
        trace: Trace | None = None,
        model: LanguageModel | None = None,
        clock: Clock | None = None,
    ) -> None:
        """Wire everything together; the plant is neither read nor written before :meth:`run`.

        Raises TypeError where ``link`` is none, and ValueError where there is no such ``mode``.

        Args:
            plant: what its tables and settings say, as :func:`homeostat.load_plant` gives it.
            link: the plant itself: samples, and the right to write.
            mode: what may be done to it: observe, advise, approve or closed loop.
            trace: takes everything that happens; a trace in memory where None.
            model: a language model that proposes before the search does.
            clock: what thinking costs in process time; as it is measured where None.
        """
        _check_link(link)
        mode = Mode(mode)
        self.trace = MemoryTrace() if trace is None else trace
        """Everything that happened."""
        self._source = link.source
        arrangement = Arrangement(mode=mode, language=None if model is None else Language(model))
        lease = link if mode.writes else None
        self._assembly = wire(plant, lease, clock or ThinkingClock(), self.trace, seed=1, arrangement=arrangement)

    def run(self, pace: float | None = None, hook: Hook = lambda seen: None) -> None:
        """Go on until the link's source ends; ``hook`` is shown every observation.

        ``pace``: process seconds per wall-clock second, 1 for a real plant; None for one in virtual time.
        ValueError where it is not finite and above 0.
        """
        if pace is not None and not (math.isfinite(pace) and pace > 0.0):
            raise ValueError(f"pace {pace!r} must be finite and > 0 process seconds per wall-clock second")
        self._assembly.run(self._source, hook, pace)

    def order(self, command: PersonCommand) -> None:
        """Take a person's order to the guard, from any thread."""
        self._assembly.guard.mailbox.put(command)


def _check_link(link: Link) -> None:
    """Refuse what would only fail, or say nothing, when the plant is read."""
    source = getattr(link, "source", None)
    for what, whole, members in (("link", link, _LINK), ("link's source", source, _SOURCE)):
        for member in members:
            if not hasattr(whole, member):
                raise TypeError(f"the {what} {whole!r} has no {member!r}; see help(homeostat.Link)")
