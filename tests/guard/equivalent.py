"""Mutants of the guard that nobody can tell from the original, each with the reason. See `tests.guard.mutate`."""

from __future__ import annotations

EQUIVALENT: dict[tuple[str, str], str] = {
    # recorder
    ("if job.done.wait(min(wait_s, self._wait_s)):", "arguments -> swapped"): "the lesser of two times is the same",
    # service
    ("unmoved = same(before, target, rule.tolerance)", "arguments -> swapped"): "being the same goes both ways",
    # tenure
    **dict.fromkeys(
        (
            (
                "wait_s = min(self._settings.again_s * 2.0 ** min(vain, 20), LONGEST_S)",
                change,
            )
            for change in ("20 -> 19", "20 -> 21", "20 -> 40", "arguments -> swapped")
        ),
        "the longest wait is reached long before, and the lesser of two is the same in either order",
    ),
    **dict.fromkeys(
        (("self.taken_s = -math.inf", change) for change in ("assignment -> pass", "USub -> nothing")),
        "nobody asks when a lease was taken that was not",
    ),
    # lapse
    ("self._lost = self._dead = False", "False -> True"): "before the first reading nothing can have been moved",
    ("if wanted and tenure.retake(now_s):", "operand 0 -> nothing"):
        "a lease that nobody wants is given back in the tick in which that is so, and is not lost any more",
    ("again = self._lost and tenure.held and readings.at_s > tenure.taken_s", "operand 0 -> nothing"):
        "where nothing was lost there is nothing to settle",
    # memory
    ("started: bool = False", "False -> True"): "where no start-up has begun nobody asks whether it is over",
    ("waiting=(), aborting=False, released=False, owed=None, left=None,", "False -> True"):
        "nothing waits after a reset, and whatever is loaded next says whose it is",
    # persons
    ("sequencer.restore(found.state, (), aborting=False)", "False -> True"):
        "nothing waits after a reset, and whatever is loaded next says by itself whether it belongs to a fallback",
    # arrivals
    ("if t.source == state and not t.on_decision and t.guard.holds(values):", "operand 0 -> nothing"):
        "what leaves another state is forgotten at once",
    ("return stated is not None and same(stated.design, target, rules.writables[tag].tolerance)",
     "arguments -> swapped"): "being the same goes both ways",
    **{
        (
            "return max((rules.writables[r.tag].confirm_s for r in stated if r.tag in rules.writables), default=0.0)",
            change,
        ): "a state that commands nothing leaves nothing to wait for"
        for change in ("0.0 -> 1", "0.0 -> -1.0")
    },
    ("return max((rules.writables[r.tag].confirm_s for r in stated if r.tag in rules.writables), default=0.0)",
     "filter 0 -> none"): "the tables refuse a state that commands what cannot be written",
    ("self._until_s = -math.inf", "USub -> nothing"): "nobody asks before something waits, which sets it",
    # seal
    (
        'return hmac.compare_digest(code(request, key).encode(), request.seal.mac.encode(errors="replace"))',
        "arguments -> swapped",
    ): "two codes are equal in either order",
    # verification
    ("slack = 1e-9 * max(abs(admitted.low), abs(admitted.high), 1.0)", "arguments -> swapped"):
        "the largest of three is the same in any order",
    ("margin = min(command.value - admitted.low, admitted.high - command.value)", "arguments -> swapped"):
        "the smaller of two is the same in either order",
    # start_up
    ('way = "" if self._over or readings is None else self._way_out(readings, state)', "operand 1 -> nothing"):
        "a guard that has no readings cannot be judged, and what cannot be judged does not hold",
    # effect
    ("self.passed_s += min(max(now_s - self.now_s, 0.0), LONGEST_S)", "arguments -> swapped"):
        "the lesser, or the larger, of two times is the same in either order",
    ("scatter = max(self.mm - self.m * self.m / n - slope * slope * spread, 0.0)", "arguments -> swapped"):
        "the larger of two is the same in either order",
    # lane
    **{("IDLE_S = 5.0", f"5.0 -> {t}"): "nobody sees how long a thread waits for work" for t in (4.0, 6.0, 10.0)},
    ("return self._result[0]", "0 -> -1"): "a call has one result",
    # writer
    **{("REMEMBERED = 100", f"100 -> {n}"): "a bound of memory, far from what happens" for n in (99, 101, 200)},
    ('self.error = ""', "assignment -> pass"): "nobody asks before an attempt has ended, which sets it",
    ("return self._flight is not None and self._flight.ended and self._flight.accepted_s is None",
     "operand 0 -> nothing"): "asked only while a write is under way",
    # flight
    ("return command.tag in readings.accepted and same(command.value, readings.accepted[command.tag], tolerance)",
     "arguments -> swapped"): "sameness goes both ways",
}  # fmt: skip
"""(line of source, change) -> why nobody can tell the difference."""
