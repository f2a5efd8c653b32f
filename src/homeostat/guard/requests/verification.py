"""Verification of requests (the chain of NAMUR NE 178): authorise, map, verify; everything in the positive.

The guard trusts nothing in a request. It keeps a copy of its own, made from the names in it and the machine in the
tables, so that nothing can be altered once it was looked at.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from homeostat.domain.plant.limits import Owner
from homeostat.domain.plant.rules import GuardRules
from homeostat.domain.plant.state_machine import SetpointRange, State, Transition
from homeostat.domain.recovery import ActionSet, Command, RecoveryPath, Step
from homeostat.domain.request import Request, Seal
from homeostat.domain.snapshot import Snapshot
from homeostat.domain.verdict import Finding
from homeostat.guard.requests.permissives import permissive_findings, refusal
from homeostat.guard.requests.seal import genuine
from homeostat.guard.texts import LONGEST, LONGEST_NAME, brief, fits, said
from homeostat.guard.watch.violations import Violation

MOST = 100
"""Most commands, steps or transitions that one part of a request may have."""
MOST_COMMANDS = 200
"""Most commands that all parts of a request may have together; a batch has 80."""
ROUNDING_S = 1e-6
"""Rounding of times that are added and subtracted [s]."""


class Unfit(Exception):
    """A request does not pass a check; ``finding`` says which."""

    def __init__(self, finding: Finding) -> None:
        super().__init__(finding.message)
        self.finding = finding


@dataclass(frozen=True, slots=True)
class Present:
    """What a request is judged on: the very reading of this tick."""

    now_s: float
    """Process time [s]."""
    readings: Snapshot | None
    """Readings with their quality; None before the first sample."""
    state: str
    """State of the machine."""
    in_service: frozenset[str]
    """Tags that the guard may write."""
    near: tuple[Violation, ...]
    """Hard limits that are undecided or half way to a trip."""
    above: tuple[Violation, ...] = ()
    """Hard limits that this very reading violates; what is asked waits until it is noise or a trip."""
    violated: frozenset[str] = frozenset()
    """Hard limits whose violation has been told as a trip."""


def mapped(request: Request, rules: GuardRules) -> tuple[Request, RecoveryPath]:
    """A copy of ``request`` that nobody else holds, its transitions taken from the tables, and its path.

    Raises Unfit for whatever does not have the form of a request, and for a path that the machine does not have. What
    is too large is refused by its size: nothing in it is copied, compared or hashed.
    """
    try:
        names, then = _items(request.path), _items(request.actions.then)
        first, *later = (_items(part.commands) for part in (request.actions, *then))
        count = len(first) + sum(map(len, later))
        if count > MOST_COMMANDS:
            raise ValueError(f"it has {count} commands; at most {MOST_COMMANDS} are looked at")
        path = RecoveryPath(rules.machine, tuple(_transition(_text(name), rules) for name in names))
        if [_text(s.transition.name) for s in then] != [t.name for t in path.awaited]:
            raise ValueError("the later steps are not those that the path waits for")
        steps = tuple(map(Step, path.awaited, map(_commands_of, later)))
        actions = ActionSet(_commands_of(first), _text(request.actions.target), steps)
        if actions.target != path.now:
            raise ValueError(f"the commands lead to {actions.target!r}, the path to {path.now!r}")
        seal = request.seal
        own = Seal(
            _text(seal.issuer), _number(seal.checked_s), _number(seal.expires_s), _text(seal.nonce), _text(seal.mac)
        )
        texts = {n: _text(getattr(request, n)) for n in ("id", "proposer", "state", "diagnosis", "configuration")}
        return Request(actions=actions, path=tuple(t.name for t in path.transitions), seal=own, **texts), path
    except BaseException as error:  # whatever a stranger made of it
        text = f"this is no request that the plant could take: {brief(str(error))}"
        raise Unfit(refusal("CHK-FORM", text)) from None


def authorise(request: Request, keys: Mapping[str, bytes], now_s: float, oldest_s: float, longest_s: float) -> None:
    """Raise Unfit unless the seal is an issuer's, of now, and covers the request as it is."""
    seal, key = request.seal, keys.get(request.seal.issuer)
    if key is None or not genuine(request, key):
        text = f"the seal of request {request.id!r} is not the release check's; have it checked again"
        raise Unfit(refusal("CHK-SEAL", text))
    age_s = now_s - seal.checked_s
    if not 0.0 <= age_s <= oldest_s:
        text = f"the release check of request {request.id!r} is {age_s:g} s old; 0 to {oldest_s:g} s are allowed"
        raise Unfit(refusal("CHK-AGE", text))
    if not now_s <= seal.expires_s:
        raise Unfit(refusal("CHK-EXPIRY", f"the seal of request {request.id!r} is void since {seal.expires_s:g} s"))
    if not seal.expires_s - seal.checked_s <= longest_s + ROUNDING_S:
        text = f"the seal of request {request.id!r} lasts {seal.expires_s - seal.checked_s:g} s"
        raise Unfit(refusal("CHK-EXPIRY", f"{text}; at most {longest_s:g} s are allowed"))


def verify(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> None:
    """Raise Unfit at the first check that ``request`` does not pass on the present reading."""
    for check in _CHECKS:
        try:
            finding = check(request, path, rules, present)
        except BaseException as error:  # a broken rule passes nothing
            finding = refusal("CHK-RULES", f"request {request.id!r} cannot be judged: {said(error)}")
        if finding is not None:
            raise Unfit(finding)


def verify_start(transition: Transition, actions: ActionSet, rules: GuardRules, present: Present) -> None:
    """Raise Unfit at the first check that a person's start does not pass on the present reading.

    It is judged as a request is: ``actions`` take ``transition`` out of the present state, and what follows. A reading
    that violates a limit by no more than noise refuses it, because nobody waits: a person can order it again.
    """
    parts = ((actions.commands, actions.target), *((s.commands, s.target) for s in actions.then))
    judged = (_admitted(commands, rules.machine.state(state), rules, present) for commands, state in parts)
    found = (
        _open(transition, present)
        or next((f for f in judged if f is not None), None)
        or _safe(actions.commands, rules, present)
    )
    if found is None and present.above:
        found = refusal(present.above[0].limit, f"hard limit at release: {present.above[0].reason}")
    if found is not None:
        raise Unfit(found)


def command_finding(
    command: Command, admitted: SetpointRange | None, state: str, rules: GuardRules, *, fallback: bool = False
) -> Finding | None:
    """Why ``command`` may not be written in ``state`` whatever the plant reads; None where it may.

    ``fallback``: it may be as fast as the equipment permits, where the tables state that.
    """
    tag, rule = rules.tags.get(command.tag), rules.writables.get(command.tag)
    if tag is None or rule is None:
        return refusal("CHK-WRITABLE", f"{command.tag!r} is not a tag that may be written")
    if admitted is None:
        return refusal("CHK-ADMISSIBLE", f"{command.tag!r} may not be commanded in state {state!r}")
    if command.value is None:
        if rule.automatic and admitted.design is None:
            return None
        return refusal("CHK-AUTOMATIC", f"{command.tag!r} has no automatic mode in state {state!r}")
    slack = 1e-9 * max(abs(admitted.low), abs(admitted.high), 1.0)
    if not admitted.low - slack <= command.value <= admitted.high + slack:
        text = f"{command.tag!r} = {command.value:.6g} {tag.unit} in state {state!r}; admitted are"
        text = f"{text} {admitted.low:.6g} to {admitted.high:.6g} {tag.unit}"
        margin = min(command.value - admitted.low, admitted.high - command.value)
        return Finding("CHK-RANGE", Owner.ACTION, margin, tag.unit, 0.0, 0, text)
    if (off := abs(command.value - tag.nearest(command.value))) > slack:
        ends = f"{tag.range.low:g} and {tag.range.high:g}"
        text = f"{command.tag!r} = {command.value:.6g} {tag.unit}; it has two positions, {ends}"
        return Finding("CHK-RANGE", Owner.ACTION, -off, tag.unit, 0.0, 0, text)
    most = tag.rate_limit
    if most is not None and fallback and rule.fastest is not None:
        most = rule.fastest
    if most is not None and not (command.rate is not None and command.rate <= most):
        rate = math.inf if command.rate is None else command.rate
        text = f"{command.tag!r} ramps at {rate:.6g} {tag.unit}/s; limit {most:.6g} {tag.unit}/s"
        return Finding("CHK-RATE", Owner.ACTION, most - rate, f"{tag.unit}/s", 0.0, 0, text)
    return None


def _empty(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    if request.actions.commands or request.actions.then:
        return None
    return refusal("CHK-EMPTY", f"request {request.id!r} commands nothing; there is nothing to release")


def _configuration(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    if request.configuration == rules.configuration:
        return None
    return refusal("CHK-CONFIGURATION", f"request {request.id!r} was approved under another configuration")


def _state(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    if request.state == path.states[0] == present.state:
        return None
    text = f"the plant is in {present.state!r}, and the request starts in {request.state!r}"
    return refusal(OVERTAKEN, text, Owner.PLANNING)


OVERTAKEN = "CHK-STATE"
"""Name of the refusal of a request whose state the plant has left."""


def _way(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    if not rules.machine.state(path.target).recovery_target:
        return refusal("CHK-TARGET", f"{path.target!r} is no state in which a recovery may end")
    return next((found for transition in path.decisions if (found := _open(transition, present))), None)


def _open(transition: Transition, present: Present) -> Finding | None:
    values = {} if present.readings is None else present.readings.values
    if transition.guard.holds(values):
        return None
    text = f"{transition.guard.text!r} does not hold, so {transition.target!r} is not open ({transition.name})"
    return refusal("CHK-OPEN", text, Owner.PLANNING)


def _commands(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    parts = (request.actions.commands, *(s.commands for s in request.actions.then))
    for commands, state in zip(parts, path.commanded_states, strict=True):
        found = _admitted(commands, state, rules, present)
        if found is not None:
            return found
    return None


def _admitted(commands: tuple[Command, ...], state: State, rules: GuardRules, present: Present) -> Finding | None:
    for command in commands:
        found = command_finding(command, state.setpoint(command.tag), state.name, rules)
        if found is None and command.tag not in present.in_service:
            found = refusal("CHK-SERVICE", f"{command.tag!r} is out of service; a person must bring it back")
        if found is not None:
            return found
    return None


def _readings(request: Request, path: RecoveryPath, rules: GuardRules, present: Present) -> Finding | None:
    return _safe(request.actions.commands, rules, present)


def _safe(commands: tuple[Command, ...], rules: GuardRules, present: Present) -> Finding | None:
    """No hard limit and no permissive forbids ``commands`` on the present reading."""
    if present.readings is None:
        return refusal("CHK-READING", "there is no reading to decide on")
    if present.near:
        return refusal(present.near[0].limit, f"hard limit at release: {present.near[0].reason}")
    found = permissive_findings(present.readings, commands, rules.limits)
    return next((replace(f, message=f"permissive at release: {f.message}") for f in found if not f.satisfied), None)


Check: TypeAlias = Callable[[Request, RecoveryPath, GuardRules, Present], Finding | None]
_CHECKS: tuple[Check, ...] = (_empty, _configuration, _state, _way, _commands, _readings)


def _transition(name: str, rules: GuardRules) -> Transition:
    for transition in rules.machine.transitions:
        if transition.name == name:
            return transition
    raise ValueError(f"the machine has no transition {name!r}")


def _items(given: Any) -> tuple[Any, ...]:
    """``given`` where it is a plain tuple that can be walked through within a tick."""
    if type(given) is not tuple:
        raise ValueError(f"a tuple is needed, not {type(given).__name__}")
    if len(given) > MOST:
        raise ValueError(f"a tuple has {len(given)} items; at most {MOST} are looked at")
    return given


def _text(given: Any, most: int = LONGEST) -> str:
    if not fits(given, most):
        raise ValueError(f"a text of at most {most} characters is needed, not {brief(given, 20)!r}")
    return str(given)


def _number(given: object) -> float:
    """``given`` as it is: an integer and the equal float do not have the same digest."""
    if isinstance(given, bool) or not isinstance(given, int | float):
        raise ValueError(f"a number is needed, not {type(given).__name__}")
    number = float(given)  # raises for an integer that is too large to calculate with
    return given if type(given) is int else number


def _commands_of(given: tuple[Any, ...]) -> tuple[Command, ...]:
    return tuple(
        Command(
            _text(c.tag, LONGEST_NAME),
            None if c.value is None else _number(c.value),
            None if c.rate is None else _number(c.rate),
        )
        for c in given
    )
