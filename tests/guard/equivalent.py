"""Mutants of the guard that nobody can tell from the original, each with the reason. See `tests.guard.mutate`."""

from __future__ import annotations

KNOWN: tuple[tuple[str, tuple[str, ...], str], ...] = (
    # arrivals
    ("if t.source == state and not t.on_decision and t.guard.holds(values):", ("operand 0 -> nothing",),
     "what leaves another state is forgotten at once"),
    ("return max((rules.writables[r.tag].confirm_s for r in stated if r.tag in rules.writables), default=0.0)",
     ("0.0 -> 1", "0.0 -> -1.0"), "a state that commands nothing leaves nothing to wait for"),
    ("return max((rules.writables[r.tag].confirm_s for r in stated if r.tag in rules.writables), default=0.0)",
     ("filter 0 -> none",), "the tables refuse a state that commands what cannot be written"),
    ("self._until_s = -math.inf", ("USub -> nothing",), "nobody asks before something waits, which sets it"),
    # lane
    ("IDLE_S = 5.0", ("5.0 -> 4.0", "5.0 -> 6.0", "5.0 -> 10.0"), "nobody sees how long a thread waits for work"),
    ("return self._result[0]", ("0 -> -1",), "a call has one result"),
    # lapse
    ("self._lost = self._dead = False", ("False -> True",), "before the first reading nothing can have been moved"),
    ("if wanted and tenure.retake(now_s):", ("operand 0 -> nothing",),
     "a lease that nobody wants is given back in the tick in which that is so, and is not lost any more"),
    ("again = self._lost and tenure.held and readings.at_s > tenure.taken_s", ("operand 0 -> nothing",),
     "where nothing was lost there is nothing to settle"),
    # memory
    ("started: bool = False", ("False -> True",), "where no start-up has begun nobody asks whether it is over"),
    ("waiting=(), aborting=False, released=False, owed=None, left=None,", ("False -> True",),
     "nothing waits after a reset, and whatever is loaded next says whose it is"),
    # persons
    ("sequencer.restore(found.state, (), aborting=False)", ("False -> True",),
     "nothing waits after a reset, and whatever is loaded next says by itself whether it belongs to a fallback"),
    # seal
    ('return hmac.compare_digest(code(request, key).encode(), request.seal.mac.encode(errors="replace"))',
     ("arguments -> swapped",), "two codes are equal in either order"),
    # start_up
    ('way = "" if self._over or readings is None else self._way_out(readings, state)', ("operand 1 -> nothing",),
     "a guard that has no readings cannot be judged, and what cannot be judged does not hold"),
    # tenure
    ("wait_s = min(self._settings.again_s * 2.0 ** min(vain, 20), LONGEST_S)", ("20 -> 19", "20 -> 21", "20 -> 40"),
     "the longest wait is reached long before"),
    ("self.taken_s = -math.inf", ("assignment -> pass", "USub -> nothing"),
     "nobody asks when a lease was taken that was not"),
    # trips
    ("return tuple(m for m in margins if not math.isnan(m))", ("filter 0 -> none",),
     "a margin under an explanation is undecided only where the reading's is, and such a one is the lesser of nothing"),
    ("return None if any(map(math.isnan, margins)) else min(margins)", ("any -> all",),
     "errors are finite: what carries a limit is undecided under every explanation or under none"),
    ("if not watched.lifting and rule.carrier is not None:", ("operand 1 -> nothing",),
     "only where something carries a limit may its trip be lifted"),
    # writer
    ("REMEMBERED = 100", ("100 -> 99", "100 -> 101", "100 -> 200"), "a bound of memory, far from what happens"),
    ('self.error = ""', ("assignment -> pass",), "nobody asks before an attempt has ended, which sets it"),
    ("return self._flight is not None and self._flight.ended and self._flight.accepted_s is None",
     ("operand 0 -> nothing",), "asked only while a write is under way"),
    ("return max((self._rules[c.tag].confirm_s for c in write.commands if c.tag in self._rules), default=0.0)",
     ("0.0 -> -1.0",), "the time that has passed is never less than nothing"),
)  # fmt: skip
"""Line of source, changes in it, and why nobody can tell the difference."""
EQUIVALENT = {(source, change): reason for source, changes, reason in KNOWN for change in changes}
"""(line of source, change) -> why nobody can tell the difference."""
