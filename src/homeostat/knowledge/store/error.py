"""What can be wrong with a plant's tables and graph: one exception whose code says which mistake it is."""

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import NamedTuple, TypeAlias


class Code(StrEnum):
    """The mistakes that are told apart."""

    BAD_TABLE = "bad-table"
    """A table cannot be read, or a row lacks what its name is made of."""
    BAD_MAPPING = "bad-mapping"
    """A table is none that the mapping reads, or the mapping and the statements differ."""
    BAD_SHAPE = "bad-shape"
    """The graph breaks one of the shapes that the system relies on."""
    BAD_NUMBER = "bad-number"
    """A cell should be a finite number and is not."""
    BAD_FORMULA = "bad-formula"
    """A formula or expression cannot be read, or adds or compares different units."""
    BAD_WORD = "bad-word"
    """A cell should be one of a few words and is another."""
    MISSING_VALUE = "missing-value"
    """Something that must be stated is not."""
    DUPLICATE_ID = "duplicate-id"
    """Two rows have the same key but say different things, or one name means two things."""
    REVERSED_RANGE = "reversed-range"
    """The lower end of a range is not below its upper end."""
    UNKNOWN_TAG = "unknown-tag"
    """A tag is used that the signal table does not have."""
    UNKNOWN_COMPONENT = "unknown-component"
    """A component is used that the equipment table does not have."""
    DISCONNECTED_COMPONENT = "disconnected-component"
    """A component is not a part, at any depth, of the whole plant."""
    UNKNOWN_PARAMETER = "unknown-parameter"
    """A parameter is used that no table has, or that the process model does not have."""
    UNKNOWN_STATE = "unknown-state"
    """A state is used that the state table does not have."""
    UNKNOWN_FEATURE = "unknown-feature"
    """A feature is used that the feature table does not have."""
    UNKNOWN_SYMPTOM = "unknown-symptom"
    """A symptom is used that the symptom table does not have."""
    UNKNOWN_FAULT = "unknown-fault"
    """A fault is used that the fault table does not have, or that the process model cannot simulate."""
    UNKNOWN_OPERATOR = "unknown-operator"
    """A process operator is used that the operator table does not have."""
    UNKNOWN_VARIABLE = "unknown-variable"
    """A tag is carried by a variable that the process model does not have."""
    UNKNOWN_SYMBOL = "unknown-symbol"
    """An equation uses a symbol that is neither a tag nor a parameter."""
    MISSING_PARAMETER = "missing-parameter"
    """The process model has a parameter that no table states."""
    MISSING_FAULT = "missing-fault"
    """The process model has a fault that the fault table does not have."""
    BAD_INITIAL_STATE = "bad-initial-state"
    """Not exactly one state is marked as initial."""
    STATE_UNREACHABLE = "state-unreachable"
    """No path of transitions leads to a state."""
    NO_RECOVERY_TARGET = "no-recovery-target"
    """No state is marked as one that a recovery may end in."""
    GUARD_NEVER_TRUE = "guard-never-true"
    """A formula cannot hold for any values inside the ranges of its tags."""
    LIMIT_NEVER_VIOLATED = "limit-never-broken"
    """A limit holds for all values inside the ranges of its tags, so it protects nothing."""
    LIMIT_OUTSIDE_RANGE = "limit-outside-range"
    """A formula compares a tag with a value that its instrument cannot show."""
    LIMIT_WITHOUT_VALUE = "limit-without-value"
    """A limit reads a manual output, which has no value while it is on automatic."""
    SETPOINT_OUTSIDE_RANGE = "setpoint-outside-range"
    """A state admits a value that is outside the range of its tag, or a design value outside its own range."""
    NOT_COMMANDABLE = "not-commandable"
    """A tag is to be commanded that is neither a setpoint nor a manipulated value."""
    FALLBACK_TAG_NOT_COMMANDABLE = "fallback-tag-not-commandable"
    """A fallback step writes a tag that cannot be commanded."""
    FALLBACK_OUTSIDE_RANGE = "fallback-outside-range"
    """A fallback step commands a value outside the range of its tag."""
    FALLBACK_NOT_ADMITTED = "fallback-not-admitted"
    """A fallback step commands what the state that it leads to does not admit."""
    FALLBACK_NOT_PERMITTED = "fallback-not-permitted"
    """What a fallback commands violates a permissive that it does not set aside."""
    UNKNOWN_FALLBACK = "unknown-fallback"
    """A fallback strategy is used that the fallback table does not have."""
    UNKNOWN_LIMIT = "unknown-limit"
    """A limit is used that the limit table does not have, or that is of another kind than is needed."""
    LIMIT_NOT_WATCHED = "limit-not-watched"
    """A hard limit has no row that says how it is watched."""
    LIMIT_NOT_SERVED = "limit-not-served"
    """No fallback is stated to bring a hard limit back."""
    CARRIER_READS_LIMIT = "carrier-reads-limit"
    """What should carry a limit reads a tag that the limit reads, so it fails with it."""
    LIFT_WITHOUT_CARRIER = "lift-without-carrier"
    """A trip may be lifted although nothing carries the limit meanwhile."""
    READING_NOT_RATED = "reading-not-rated"
    """A rule of the guard reads a tag of which no row says when its reading is good or bad."""
    FROZEN_WITHOUT_NOISE = "frozen-without-noise"
    """A reading without noise would be called frozen because it does not change."""
    TAG_NOT_WRITABLE = "tag-not-writable"
    """A tag is commanded somewhere, but no row says how a command is confirmed."""
    NO_FALLBACK = "no-fallback"
    """The plant has no way to a safe state."""
    FAULT_WITHOUT_SYMPTOM = "fault-without-symptom"
    """No symptom indicates a fault, so it could never be diagnosed."""
    SYMPTOM_WITHOUT_FAULT = "symptom-without-fault"
    """A symptom indicates no fault."""
    SEVERITY_OUTSIDE_RANGE = "severity-outside-range"
    """A fault's nominal severity is outside its own range."""
    CRITERION_WINDOW_BEYOND_HORIZON = "criterion-window-beyond-horizon"
    """A criterion looks further ahead than a rollout goes."""
    LOOP_ROLE = "loop-role"
    """A tag of a control loop does not have the role that its place in the loop needs."""
    LIMIT_LOOKS_AHEAD = "limit-looks-ahead"
    """A guard or limit is judged on one moment but has a temporal operator."""
    STALE_GRAPH = "stale-graph"
    """A table or the mapping changed after the graph was built."""
    ALTERED = "altered"
    """A generated file is not as it was generated."""
    BAD_BASELINE = "bad-baseline"
    """A plant's reference values are missing, cannot be, or were learned from something else."""
    DANGLING_REFERENCE = "dangling-reference"
    """Something is referred to that the graph says nothing about."""
    UNKNOWN_TERM = "unknown-term"
    """A property or class is used that no vocabulary declares, but that comes close to one that is declared."""
    SWAPPED_PREFIX = "swapped-prefix"
    """A name is used in one namespace that is known in another one only."""
    TRANSITION_WITHOUT_CONDITION = "transition-without-condition"
    """A transition has neither a guard nor an event, so nothing says when it is taken."""
    UNREACHED_COMPONENT = "unreached-component"
    """A component has no interface, connection or flow where most others of its class have one."""


class GraphError(ValueError):
    """A mistake in a plant's tables or graph; one line that names the thing and the remedy."""

    def __init__(self, code: Code, thing: str, message: str) -> None:
        """``thing`` is what has the mistake, for example ``limit 'LIM-T-HIGH'``."""
        super().__init__(f"[{code}] {thing}: {message}")
        self.code = code
        self.thing = thing
        self.message = message


class Mistake(NamedTuple):
    """What a check finds."""

    code: Code
    """Which kind of mistake it is."""
    thing: str
    """What has the mistake, for example ``limit 'LIM-T-HIGH'``."""
    message: str
    """What is wrong, with value, limit and unit, and what to do."""

    def __str__(self) -> str:
        """One line."""
        return f"[{self.code}] {self.thing}: {self.message}"


Found: TypeAlias = Iterator[tuple[Code, str, str]]
"""Mistakes as the parts of a check yield them."""


def refuse(found: Sequence[Mistake | GraphError]) -> None:
    """GraphError with the first of ``found`` and the number of the others, where there is any."""
    if found:
        more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
        raise GraphError(found[0].code, found[0].thing, found[0].message + more)
