"""The playbook's proposer: what helped on the nearest occasion, then on the next one."""

from homeostat.agents.playbook.book import Book, Known
from homeostat.agents.playbook.distance import FAR
from homeostat.agents.roles import NoAdmissiblePlan, Proposer, Situation
from homeostat.domain.advice import Advice, Attempt
from homeostat.domain.recovery import ActionSet, RecoveryPath
from homeostat.domain.verdict import Approve

NAME = "playbook"
"""Who proposes, in the journal."""
ATTEMPTS = 3
"""Most entries that are tried in one recovery: whoever has to look farther had better search."""


class Remembering:
    """Planning, action and reprompting of a :class:`Book`; none of them thinks, and none decides."""

    def __init__(self, book: Book) -> None:
        """``book`` is in memory; in a run nothing is added to it."""
        self._book = book

    async def plan(self, situation: Situation, advice: Advice) -> RecoveryPath:
        """The path of the nearest entry that was not tried yet."""
        left = self._left(situation, advice)
        if not left:
            raise NoAdmissiblePlan(f"no {'other ' * bool(advice.attempts)}entry is near: within a distance of {FAR:g}")
        return left[0].path

    async def act(self, situation: Situation, path: RecoveryPath, advice: Advice) -> ActionSet:
        """The commands of the nearest one with this ``path``, as they were released."""
        for known in self._left(situation, advice):
            if known.path == path:
                return known.actions
        raise NoAdmissiblePlan(f"nothing that takes {' > '.join(path.states)} is near any more")

    async def advise(self, situation: Situation, attempt: Attempt, before: Advice) -> Advice:
        """Go on to the next entry, whatever was wrong with this one."""
        return Advice(() if isinstance(attempt.verdict, Approve) else attempt.verdict.violated)

    def _left(self, situation: Situation, advice: Advice) -> list[Known]:
        """What is near, open now, and neither tried nor refused, the nearest first."""
        tried = {a.actions.digest for a in advice.attempts if a.actions is not None}
        values = situation.snapshot.values
        return [
            known
            for _, known in self._book.near(situation)
            if known.actions.digest not in tried
            and known.path.commanded not in advice.refused_paths
            and all(t.guard.holds(values) for t in known.path.decisions)
        ]


def remembering(book: Book) -> Proposer:
    """The proposer of ``book``."""
    one = Remembering(book)
    return Proposer(NAME, one, one, one, ATTEMPTS, improves=True)
