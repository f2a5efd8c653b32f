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
    # bounded
    ("return BoundedWire(wire, lanes[0], question, BoundedWire(wire, lanes[1], question))", ("1 -> -1",),
     "there are two lanes"),
    ("return (free or self._questions)[0]", ("0 -> -1",),
     "in every lane that is free nothing hangs, and where it hangs in all of them any will do"),
    ("if self.call.answered or self.call.age_s <= self._within_s:", ("LtE -> Lt (0)",),
     "nobody meets the very instant"),
    # guard
    ("return self.mode.writes and (writing or self._steps.owes or self._parts.sequencer.carries)",
     ("operand 0 -> nothing",), "where nobody writes only a fallback is sent, and under one the plant waits anyhow"),
    ("if self._stopped:", ("branch -> pass",),
     "after a stop the record has ended, the lease is given back, and nobody has asked for anything"),
    ("if isinstance(progress, Failed) and write is not None:", ("operand 1 -> nothing",), "what fails is a write"),
    ("elif progress is Progress.CONFIRMED and write is not None:", ("operand 1 -> nothing",),
     "what is confirmed is a write"),
    ("self._requests.follow(progress if write and write.cause is Cause.REQUEST else None, now_s)",
     ("if -> always", "operand 1 -> nothing"), "while a request is being written nothing else is"),
    ("names = tuple(islice(message.strategies, MOST_HEARD + 1))", ("1 -> 2",), "either is more than may be ranked"),
    ("if self.latched is None and self._requests.decide(self._present(), self.mode, self._oldest_s):",
     ("operand 0 -> nothing",), "while a fallback is latched no request waits"),
    # lane
    ("IDLE_S = 5.0", ("5.0 -> 4.0", "5.0 -> 6.0", "5.0 -> 10.0"), "nobody sees how long a thread waits for work"),
    ("return self._result[0]", ("0 -> -1",), "a call has one result"),
    ("self._staffed = True", ("assignment -> pass", "True -> False"),
     "nothing is begun behind a call before its thread has taken it, which sets it"),
    # lapse
    ("self._lost = self._dead = False", ("False -> True",), "before the first reading nothing can have been moved"),
    ("if wanted and tenure.retake(now_s):", ("operand 0 -> nothing",),
     "a lease that nobody wants is given back in the tick in which that is so, and is not lost any more"),
    ("again = self._lost and tenure.held and readings.at_s > tenure.taken_s", ("operand 0 -> nothing",),
     "where nothing was lost there is nothing to settle"),
    # latch
    ("self.standing = False", ("False -> True",), "where nothing has acted nothing is sent, put right or judged"),
    ("self._loaded = self._held = False", ("False -> True",),
     "the one is set before a fallback is written, the other before a restart asks for it"),
    ("self._again_s = -math.inf", ("USub -> nothing",), "a vain round sets it, and before one something acts at once"),
    ("self._tried = frozenset[str]()", ("assignment -> pass",), "only a restart asks for it, and sets it"),
    ('self._write(following, self.reason or "", now_s)', ("operand 1 -> nothing",), "what gives way has a reason"),
    ('self._write(chosen, self.reason or "", now_s)', ("operand 1 -> nothing",), "what acts has a reason"),
    ('self._parts.alarms.raise_("latched", self.reason or "", Priority.CRITICAL, now_s)', ("operand 1 -> nothing",),
     "what is restored has a reason"),
    ("if self.reason is not None and not self.standing:", ("operand 0 -> nothing",),
     "only while something is latched can a target have been taken for moved meanwhile"),
    ("self._held, self.standing = False, bool(acted) and not strategy and acted not in self.fallbacks.spent",
     ("False -> True",), "it is asked once per life"),
    ("self.fallbacks.begin(strategy or acted, self._tried)", ("operand 0 -> nothing",),
     "what is sent again is what acted last"),
    ("self.reason, self.strategy, self._acting, self._again_s = None, None, None, -math.inf", ("USub -> nothing",),
     "a vain round sets it, and before one something acts at once"),
    ("self._loaded = self.standing = False", ("False -> True",), "nobody asks before the next fallback sets them"),
    ("acting = self._acting if ours else None", ("if -> always",), "while a strategy acts nothing else is written"),
    ('self.fallbacks.begin("" if self.strategy is None else self.strategy.name)', ("if -> never", "Is -> IsNot (0)"),
     "what was not put right belongs to a strategy"),
    # memory
    ("REMEMBERED = 10_000", ("10000 -> 9999", "10000 -> 10001", "10000 -> 20000"),
     "a bound of memory, far from what happens"),
    ("memory = memory if trial is memory.trial else replace(memory, trial=trial)", ("if -> never",),
     "a copy that is equal"),
    ("started: bool = False", ("False -> True",), "where no start-up has begun nobody asks whether it is over"),
    ("memory = replace(memory, waiting=(), aborting=False, released=False, owed=None, left=None)", ("False -> True",),
     "nothing waits after a reset, and whatever is loaded next says whose it is"),
    ("latched: bool = False", ("False -> True",), "whoever reads a journal says it"),
    ("return replace(memory, waiting=()) if last is not None and last.taken else memory", ("operand 0 -> nothing",),
     "what was answered was written"),
    # modes
    ("self._wanted = mode if objection and self._tenure.awaited else None", ("operand 0 -> nothing",),
     "where there is no objection the lease has come"),
    # moves
    ("if tag not in writer.pending:", ("branch -> pass",),
     "a ramp that still leads anywhere is pending, and what is not was sent by nobody"),
    # persons
    ("sequencer.restore(found.state, (), aborting=False)", ("False -> True",),
     "nothing waits after a reset, and whatever is loaded next says by itself whether it belongs to a fallback"),
    ("self._give_up(self._unread[1], now_s)", ("1 -> -1",), "it is a pair"),
    ('text = f"{why} before the plant was read to hold {self._unread[1]!r}: nothing follows it"', ("1 -> -1",),
     "it is a pair"),
    # ramp
    ("self._passed[tag] = min(low, ramp.way[0]), max(high, ramp.way[1])", ("1 -> -1",), "it is a pair"),
    # response
    ("self._strategy = trial.acted or None", ("operand 1 -> nothing",), "where nothing had acted nothing was followed"),
    ("if strategy != self._strategy or not self._latch.standing or self._parts.tenure.lost:",
     ("operand 0 -> nothing",), "a strategy that is new does not stand yet"),
    # restart
    ("self._latched = False", ("assignment -> pass", "False -> True"), "a latch is restored once, whoever asks"),
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
    ("over = wire is not None and bool(wire.void)", ("operand 0 -> nothing",),
     "what is not there raises, and is not over either"),
    # trial
    ("used_s = max(used_s, longest_s - max(self.lifting[limit] - now_s, 0.0))", ("0.0 -> -1.0",),
     "who has used more than all of it has none left either"),
    # trips
    ("return tuple(m for m in margins if not math.isnan(m))", ("filter 0 -> none",),
     "a margin under an explanation is undecided only where the reading's is, and such a one is the lesser of nothing"),
    ("return None if any(map(math.isnan, margins)) else min(margins)", ("any -> all",),
     "errors are finite: what carries a limit is undecided under every explanation or under none"),
    ("if not watched.lifting and rule.carrier is not None:", ("operand 1 -> nothing",),
     "only where something carries a limit may its trip be lifted"),
    # writer
    ("REMEMBERED = 100", ("100 -> 99", "100 -> 101", "100 -> 200"), "a bound of memory, far from what happens"),
    ("return self._flight is not None and self._flight.ended and self._flight.accepted_s is None",
     ("operand 0 -> nothing",), "asked only while a write is under way"),
    ("return max((self._rules[c.tag].confirm_s for c in write.commands if c.tag in self._rules), default=0.0)",
     ("0.0 -> -1.0",), "the time that has passed is never less than nothing"),
)  # fmt: skip
"""Line of source, changes in it, and why nobody can tell the difference."""
EQUIVALENT = {(source, change): reason for source, changes, reason in KNOWN for change in changes}
"""(line of source, change) -> why nobody can tell the difference."""
