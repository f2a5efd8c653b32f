"""Ways to break each table, with the name of the mistake."""
# ruff: noqa: E501  (a table of mistakes reads best with one mistake per line)

from __future__ import annotations

from collections.abc import Callable

from homeostat.knowledge.store.error import Code
from tests.knowledge.tables import Rows

Change = Callable[[Rows], Rows]
"""Rows of a table -> the rows with a mistake."""


def cell(column: str, value: str, row: int = 0) -> Change:
    """Put ``value`` into one cell."""
    return lambda rows: [{**r, column: value} if i == row else r for i, r in enumerate(rows)]


def every(column: str, value: str) -> Change:
    """Put ``value`` into a whole column."""
    return lambda rows: [{**r, column: value} for r in rows]


def where(condition: Callable[[dict[str, str]], bool], **values: str) -> Change:
    """Put values into the first row that fulfils a condition."""

    def change(rows: Rows) -> Rows:
        chosen = next(i for i, row in enumerate(rows) if condition(row))
        return [{**row, **values} if i == chosen else row for i, row in enumerate(rows)]

    return change


def swapped(one: str, other: str, row: int = 0) -> Change:
    """Exchange two cells of a row."""
    return lambda rows: [{**r, one: r[other], other: r[one]} if i == row else r for i, r in enumerate(rows)]


def again(**values: str) -> Change:
    """Repeat the first row with other values."""
    return lambda rows: [*rows, {**rows[0], **values}]


def without_first(rows: Rows) -> Rows:
    return rows[1:]


def without(column: str) -> Change:
    """Remove all rows that agree with the first one in a column."""
    return lambda rows: [row for row in rows if row[column] != rows[0][column]]


def nothing(rows: Rows) -> Rows:
    return []


def one(**values: str) -> Change:
    """Nothing but one row."""
    return lambda rows: [values]


def two(strategy: str, permissive: str, reason: str) -> Change:
    """Nothing but two rows about the same, of which the second gives another reason."""
    row = {"strategy": strategy, "permissive": permissive, "reason": reason}
    return lambda rows: [row, {**row, "reason": f"Not {reason}"}]


BROKEN: list[tuple[str, str, Change, Code]] = [
    ("equipment", "kind misspelt", cell("kind", "Pmup", 3), Code.BAD_WORD),
    ("equipment", "part of nothing known", cell("part_of", "nowhere", 3), Code.UNKNOWN_COMPONENT),
    ("equipment", "part of itself", lambda rows: [*rows, {**rows[-1], "id": "X9", "part_of": "X9"}], Code.DISCONNECTED_COMPONENT),
    ("equipment", "same id twice", again(label="Something else"), Code.DUPLICATE_ID),
    ("equipment", "row lost", lambda rows: [r for r in rows if r["kind"] != "Actuator"], Code.UNKNOWN_COMPONENT),
    ("equipment", "no label", cell("label", "", 3), Code.BAD_SHAPE),
    ("equipment", "sensor without a tag", lambda rows: [*rows, {**rows[-1], "id": "X9", "kind": "Sensor"}], Code.BAD_SHAPE),
    ("equipment", "actuator without a tag", lambda rows: [*rows, {**rows[-1], "id": "X9", "kind": "Actuator"}], Code.BAD_SHAPE),
    ("signals", "role unknown", cell("role", "XX"), Code.BAD_WORD),
    ("signals", "role missing", cell("role", ""), Code.BAD_WORD),
    ("signals", "range reversed", swapped("low", "high"), Code.REVERSED_RANGE),
    ("signals", "range is no number", cell("low", "low"), Code.BAD_NUMBER),
    ("signals", "scale zero", cell("scale", "0"), Code.BAD_NUMBER),
    ("signals", "scale missing", cell("scale", ""), Code.MISSING_VALUE),
    ("signals", "unit missing", cell("unit", ""), Code.MISSING_VALUE),
    ("signals", "relation unknown", cell("relation", "masures"), Code.BAD_WORD),
    ("signals", "component unknown", cell("component", "TT99"), Code.UNKNOWN_COMPONENT),
    ("signals", "variable unknown to the model", cell("variable", "no_such"), Code.UNKNOWN_VARIABLE),
    ("signals", "variable missing", cell("variable", ""), Code.MISSING_VALUE),
    ("signals", "row lost", without_first, Code.UNKNOWN_TAG),
    ("signals", "same tag twice", again(description="Something else"), Code.DUPLICATE_ID),
    ("signals", "rate limit negative", cell("rate_limit", "-1"), Code.BAD_NUMBER),
    ("signals", "increment zero", cell("increment", "0"), Code.BAD_NUMBER),
    ("signals", "a setpoint that drives", where(lambda r: r["relation"] == "drives", role="STATUS"), Code.LOOP_ROLE),
    ("signals", "name that formulas cannot use", lambda rows: [*rows, {**rows[0], "tag": "T 1"}], Code.BAD_SHAPE),
    ("sensors", "component unknown", cell("component", "TT99"), Code.UNKNOWN_COMPONENT),
    ("sensors", "noise is no number", cell("noise_sd", "small"), Code.BAD_NUMBER),
    ("sensors", "noise missing", cell("noise_sd", ""), Code.MISSING_VALUE),
    ("sensors", "row lost", without_first, Code.MISSING_PARAMETER),
    ("sensors", "same parameter twice", lambda rows: [{**rows[0], "parameter_bias": rows[1]["parameter_bias"], "bias_sd": "9"}, *rows[1:]], Code.DUPLICATE_ID),
    ("loops", "measured tag unknown", cell("pv", "T99"), Code.UNKNOWN_TAG),
    ("loops", "measured tag missing", cell("pv", ""), Code.MISSING_VALUE),
    ("loops", "places exchanged", swapped("pv", "sp"), Code.LOOP_ROLE),
    ("loops", "gain unknown", cell("gain", "Kx"), Code.UNKNOWN_PARAMETER),
    ("loops", "controller unknown", cell("controller", "XIC9"), Code.UNKNOWN_COMPONENT),
    ("loops", "operator unknown", cell("operator", "PO_Nothing"), Code.BAD_SHAPE),
    ("loops", "same id twice", again(label="Something else"), Code.DUPLICATE_ID),
    ("operators", "resource unknown", cell("resource", "nowhere"), Code.BAD_SHAPE),
    ("operators", "successor unknown", cell("successor", "PO_Nothing"), Code.BAD_SHAPE),
    ("operators", "row lost", without_first, Code.UNKNOWN_OPERATOR),
    ("flows", "direction misspelt", cell("direction", "inptu"), Code.BAD_SHAPE),
    ("flows", "kind misspelt", cell("kind", "Prodct"), Code.BAD_SHAPE),
    ("flows", "operator unknown", cell("operator", "PO_Nothing"), Code.BAD_SHAPE),
    ("flows", "tag unknown", cell("tag", "T99"), Code.BAD_SHAPE),
    ("flows", "same flow, two labels", again(label="Something else"), Code.BAD_SHAPE),
    ("equations", "operator unknown", cell("operator", "PO_Nothing"), Code.UNKNOWN_OPERATOR),
    ("equations", "syntax", cell("expression", "F1 - * F2"), Code.BAD_FORMULA),
    ("equations", "symbol unknown", cell("expression", "F1 - F_nothing"), Code.UNKNOWN_SYMBOL),
    ("equations", "no result", cell("result", ""), Code.BAD_SHAPE),
    ("equations", "same id twice", again(result="X"), Code.DUPLICATE_ID),
    ("parameters", "value missing", cell("value", ""), Code.MISSING_VALUE),
    ("parameters", "value is no number", cell("value", "five"), Code.BAD_NUMBER),
    ("parameters", "unit missing", cell("unit", ""), Code.MISSING_VALUE),
    ("parameters", "spread misspelt", cell("spread", "relativ"), Code.MISSING_VALUE),
    ("parameters", "spread negative", cell("sd", "-0.1"), Code.BAD_NUMBER),
    ("parameters", "component unknown", cell("component", "J99"), Code.UNKNOWN_COMPONENT),
    ("parameters", "row lost", lambda rows: rows[:-1], Code.MISSING_PARAMETER),
    ("parameters", "row lost that a formula names", without_first, Code.UNKNOWN_TAG),
    ("parameters", "unknown to the model", again(symbol="no_such"), Code.UNKNOWN_PARAMETER),
    ("parameters", "same symbol twice", again(value="1"), Code.DUPLICATE_ID),
    ("parameters", "symbol of a tag", lambda rows: [*rows, {**rows[0], "symbol": "T1"}], Code.DUPLICATE_ID),
    ("states", "no initial state", every("initial", "no"), Code.BAD_INITIAL_STATE),
    ("states", "two initial states", lambda rows: every("initial", "yes")(rows[:2]) + rows[2:], Code.BAD_INITIAL_STATE),
    ("states", "neither yes nor no", cell("recovery_target", "maybe"), Code.MISSING_VALUE),
    ("states", "no recovery target", every("recovery_target", "no"), Code.NO_RECOVERY_TARGET),
    ("states", "risk is no number", cell("risk", "high"), Code.BAD_NUMBER),
    ("states", "risk is no whole number", cell("risk", "1.5"), Code.BAD_NUMBER),
    ("states", "risk negative", cell("risk", "-1"), Code.BAD_SHAPE),
    ("states", "row lost", lambda rows: rows[:-1], Code.UNKNOWN_STATE),
    ("states", "never settled", cell("settled_when", "false"), Code.GUARD_NEVER_TRUE),
    ("states", "settled later", cell("settled_when", "eventually[0,10] (T1 >= 300)"), Code.LIMIT_LOOKS_AHEAD),
    ("states", "settled syntax", cell("settled_when", "T1 =< 3"), Code.BAD_FORMULA),
    ("states", "same id twice", again(risk="9"), Code.DUPLICATE_ID),
    ("states", "unreachable", lambda rows: [*rows, {**rows[-1], "id": "lost"}], Code.STATE_UNREACHABLE),
    ("transitions", "source unknown", cell("source", "nowhere"), Code.UNKNOWN_STATE),
    ("transitions", "target unknown", cell("target", "nowhere"), Code.UNKNOWN_STATE),
    ("transitions", "event missing", cell("event", ""), Code.BAD_TABLE),
    ("transitions", "guard missing", cell("guard", ""), Code.MISSING_VALUE),
    ("transitions", "guard names an unknown tag", cell("guard", "T99 >= 3"), Code.UNKNOWN_TAG),
    ("transitions", "guard syntax", cell("guard", "T1 >= 3 and"), Code.BAD_FORMULA),
    ("transitions", "guard can never hold", cell("guard", "T1 >= 300 and T1 <= 299"), Code.GUARD_NEVER_TRUE),
    ("transitions", "guard outside the instrument", cell("guard", "T1 <= 5000"), Code.LIMIT_OUTSIDE_RANGE),
    ("transitions", "guard looks ahead", cell("guard", "always[0,10] (T1 >= 300)"), Code.LIMIT_LOOKS_AHEAD),
    ("transitions", "way lost", without_first, Code.STATE_UNREACHABLE),
    ("transitions", "same id twice", lambda rows: [*rows, {**rows[0], "guard": "true"}], Code.DUPLICATE_ID),
    ("state_requirements", "component unknown", cell("component", "V99"), Code.UNKNOWN_COMPONENT),
    ("state_requirements", "state unknown", cell("state", "nowhere"), Code.BAD_SHAPE),
    ("setpoints", "tag unknown", cell("tag", "T99"), Code.UNKNOWN_TAG),
    ("setpoints", "state unknown", cell("state", "nowhere"), Code.BAD_SHAPE),
    ("setpoints", "range reversed", cell("low", "1e6"), Code.REVERSED_RANGE),
    ("setpoints", "end missing", cell("high", ""), Code.MISSING_VALUE),
    ("setpoints", "outside the tag's range", cell("high", "1e6"), Code.SETPOINT_OUTSIDE_RANGE),
    ("setpoints", "design outside its own range", cell("design", "-1e6"), Code.SETPOINT_OUTSIDE_RANGE),
    ("setpoints", "a measured tag", cell("tag", "T1"), Code.NOT_COMMANDABLE),
    ("setpoints", "a tag that a loop writes", cell("tag", "V2.cmd"), Code.NOT_COMMANDABLE),
    ("setpoints", "same tag twice in a state", again(low="-1e6"), Code.DUPLICATE_ID),
    ("limits", "trip limit that is not hard", cell("hard", "no"), Code.LIMIT_NOT_WATCHED),
    ("limits", "kind misspelt", cell("kind", "interlok"), Code.BAD_WORD),
    ("limits", "neither yes nor no", cell("hard", "maybe"), Code.MISSING_VALUE),
    ("limits", "formula missing", cell("formula", ""), Code.MISSING_VALUE),
    ("limits", "formula names an unknown tag", cell("formula", "T99 <= 3"), Code.UNKNOWN_TAG),
    ("limits", "formula syntax", cell("formula", "T1 <="), Code.BAD_FORMULA),
    ("limits", "source missing", cell("source", ""), Code.MISSING_VALUE),
    ("limits", "outside the instrument", cell("formula", "T1 <= 5000"), Code.LIMIT_OUTSIDE_RANGE),
    ("limits", "protects nothing", cell("formula", "abs(V1.cmd) <= 1"), Code.LIMIT_NEVER_VIOLATED),
    ("limits", "can never hold", cell("formula", "T1 + 1 <= T1 - 200"), Code.GUARD_NEVER_TRUE),
    ("limits", "looks ahead", cell("formula", "always (T1 <= 313)"), Code.LIMIT_LOOKS_AHEAD),
    ("limits", "reads what may be automatic", cell("formula", "V2.man <= 0.9"), Code.LIMIT_WITHOUT_VALUE),
    ("limits", "same id twice", again(source="Something else"), Code.DUPLICATE_ID),
    ("criteria", "owner unknown", cell("owner", "nobody"), Code.BAD_WORD),
    ("criteria", "formula names an unknown tag", cell("formula", "always (T99 <= 3)"), Code.UNKNOWN_TAG),
    ("criteria", "formula syntax", cell("formula", "always [10,0] (T1 <= 3)"), Code.BAD_FORMULA),
    ("criteria", "window beyond the rollout", cell("formula", "always[0,99999] (T1 <= 313)"), Code.CRITERION_WINDOW_BEYOND_HORIZON),
    ("criteria", "windows add up", cell("formula", "eventually[0,2000] always[0,2000] (T1 <= 313)"), Code.CRITERION_WINDOW_BEYOND_HORIZON),
    ("criteria", "can never hold", cell("formula", "always (T1 >= 310 and T1 <= 300)"), Code.GUARD_NEVER_TRUE),
    ("criteria", "same id twice", again(source="Something else"), Code.DUPLICATE_ID),
    ("prices", "kind unknown", cell("kind", "rebate"), Code.BAD_WORD),
    ("prices", "state unknown", where(lambda r: r["kind"] == "state", item="siesta"), Code.UNKNOWN_STATE),
    ("prices", "criterion unknown", where(lambda r: r["kind"] == "criterion", item="ACC-99"), Code.UNKNOWN_LIMIT),
    ("prices", "criterion is hard", where(lambda r: r["kind"] == "criterion", item="ACC-T-HIGH"), Code.UNKNOWN_LIMIT),
    ("prices", "limit unknown", where(lambda r: r["kind"] == "limit", item="LIM-99"), Code.UNKNOWN_LIMIT),
    ("prices", "limit is an envelope", where(lambda r: r["kind"] == "limit", item="LIM-T-LOW"), Code.UNKNOWN_LIMIT),
    ("prices", "limit is a permissive", where(lambda r: r["kind"] == "limit", item="PRM-FEED"), Code.UNKNOWN_LIMIT),
    ("prices", "no number", cell("price", "dear"), Code.BAD_NUMBER),
    ("prices", "not finite", cell("price", "inf"), Code.BAD_NUMBER),
    ("prices", "negative", cell("price", "-1"), Code.BAD_SHAPE),
    ("prices", "price missing", cell("price", ""), Code.MISSING_VALUE),
    ("prices", "description missing", cell("description", ""), Code.BAD_SHAPE),
    ("prices", "same item twice", again(price="2"), Code.DUPLICATE_ID),
    ("prices", "two products", again(item="by-product"), Code.DUPLICATE_ID),
    ("prices", "two prices of a release", lambda rows: [*rows, {**rows[1], "item": "every one"}], Code.DUPLICATE_ID),
    ("fallbacks", "tag unknown", cell("tag", "T99"), Code.UNKNOWN_TAG),
    ("fallbacks", "a measured tag", cell("tag", "T1"), Code.FALLBACK_TAG_NOT_COMMANDABLE),
    ("fallbacks", "a tag that a loop writes", cell("tag", "V2.cmd"), Code.FALLBACK_TAG_NOT_COMMANDABLE),
    ("fallbacks", "outside the tag's range", cell("value", "1e6"), Code.FALLBACK_OUTSIDE_RANGE),
    ("fallbacks", "value is no number", cell("value", "open"), Code.BAD_NUMBER),
    ("fallbacks", "step twice", cell("step", "2"), Code.DUPLICATE_ID),
    ("fallbacks", "tag twice", again(step="99"), Code.DUPLICATE_ID),
    ("fallbacks", "neither yes nor no", cell("out_of_service", "maybe"), Code.MISSING_VALUE),
    ("fallbacks", "not what its state admits", where(lambda r: r["tag"] == "XV1.cmd", value="1"), Code.FALLBACK_NOT_ADMITTED),
    ("fallbacks", "nothing of the tag admitted", where(lambda r: r["tag"] == "V2.man", tag="T1.sp", value="300"), Code.FALLBACK_NOT_ADMITTED),
    ("fallbacks", "against a permissive", where(lambda r: r["tag"] == "F1.sp", value="0.03"), Code.FALLBACK_NOT_PERMITTED),
    ("fallbacks", "automatic where there is none", where(lambda r: r["tag"] == "F1.sp", value=""), Code.TAG_NOT_WRITABLE),
    ("fallback_waivers", "strategy unknown", one(strategy="flee", permissive="PRM-FEED", reason="r"), Code.UNKNOWN_FALLBACK),
    ("fallback_waivers", "permissive unknown", one(strategy="drain", permissive="PRM-99", reason="r"), Code.UNKNOWN_LIMIT),
    ("fallback_waivers", "a hard limit", one(strategy="drain", permissive="LIM-T-HIGH", reason="r"), Code.UNKNOWN_LIMIT),
    ("fallback_waivers", "no reason", one(strategy="drain", permissive="PRM-FEED", reason=""), Code.MISSING_VALUE),
    ("fallback_waivers", "two reasons", two(strategy="drain", permissive="PRM-FEED", reason="r"), Code.DUPLICATE_ID),
    ("fallback_limits", "strategy unknown", cell("strategy", "flee"), Code.UNKNOWN_FALLBACK),
    ("fallback_limits", "limit unknown", cell("limit", "LIM-99"), Code.UNKNOWN_LIMIT),
    ("fallback_limits", "not a hard limit", again(limit="LIM-T-LOW"), Code.UNKNOWN_LIMIT),
    ("fallback_limits", "nobody serves a limit", lambda rows: [r for r in rows if r["limit"] != "LIM-T-HIGH"], Code.LIMIT_NOT_SERVED),
    ("fallback_limits", "for ever", cell("acts_within_s", "1e9"), Code.BAD_NUMBER),
    ("fallback_limits", "in no time", cell("acts_within_s", "0"), Code.BAD_NUMBER),
    ("fallback_limits", "no time", cell("acts_within_s", ""), Code.MISSING_VALUE),
    ("fallback_limits", "rest negative", cell("rest", "-1"), Code.BAD_NUMBER),
    ("fallback_limits", "same limit twice", again(rest="3"), Code.DUPLICATE_ID),
    ("quality", "tag unknown", cell("tag", "T99"), Code.UNKNOWN_TAG),
    ("quality", "row lost", without_first, Code.READING_NOT_RATED),
    ("quality", "stale at once", cell("stale_s", "0"), Code.BAD_NUMBER),
    ("quality", "never stale", cell("stale_s", "1e9"), Code.BAD_NUMBER),
    ("quality", "stale is missing", cell("stale_s", ""), Code.MISSING_VALUE),
    ("quality", "noise negative", cell("noise", "-0.5"), Code.BAD_NUMBER),
    ("quality", "noise is not finite", cell("noise", "nan"), Code.BAD_NUMBER),
    ("quality", "frozen without noise", cell("noise", ""), Code.FROZEN_WITHOUT_NOISE),
    ("quality", "moves never", cell("fastest", "0"), Code.BAD_NUMBER),
    ("quality", "grace negative", cell("grace_s", "-1"), Code.BAD_NUMBER),
    ("quality", "no description", cell("description", ""), Code.BAD_SHAPE),
    ("quality", "same tag twice", again(stale_s="9"), Code.DUPLICATE_ID),
    ("trips", "limit unknown", cell("limit", "LIM-99"), Code.UNKNOWN_LIMIT),
    ("trips", "not a hard limit", again(limit="LIM-T-LOW"), Code.UNKNOWN_LIMIT),
    ("trips", "row lost", without_first, Code.LIMIT_NOT_WATCHED),
    ("trips", "threshold negative", cell("cusum", "-8"), Code.BAD_NUMBER),
    ("trips", "threshold infinite", cell("cusum", "inf"), Code.BAD_NUMBER),
    ("trips", "blind for an hour", cell("grace_s", "3600"), Code.BAD_NUMBER),
    ("trips", "carrier names an unknown tag", cell("carrier", "T99 <= 3"), Code.UNKNOWN_TAG),
    ("trips", "carrier syntax", cell("carrier", "T2 <="), Code.BAD_FORMULA),
    ("trips", "carrier reads what it stands in for", cell("carrier", "T1 <= 312"), Code.CARRIER_READS_LIMIT),
    ("trips", "carrier reads what the controller makes of it", cell("carrier", "T1.err <= 2"), Code.CARRIER_READS_LIMIT),
    ("trips", "carrier reads the controller's output", cell("carrier", "V2.cmd <= 0.9"), Code.CARRIER_READS_LIMIT),
    ("trips", "carrier looks ahead", cell("carrier", "always (T2 <= 352)"), Code.LIMIT_LOOKS_AHEAD),
    ("trips", "carrier always holds", cell("carrier", "abs(V1.cmd) <= 1"), Code.LIMIT_NEVER_VIOLATED),
    ("trips", "carrier never holds", cell("carrier", "T2 >= 320 and T2 <= 310"), Code.GUARD_NEVER_TRUE),
    ("trips", "carrier reads a tag without quality", cell("carrier", "V2.man <= 0.5"), Code.READING_NOT_RATED),
    ("trips", "nothing carries what is lifted", cell("carrier", ""), Code.LIFT_WITHOUT_CARRIER),
    ("trips", "lifted for ever", cell("lift_s", "1e9"), Code.BAD_NUMBER),
    ("trips", "lifted for no time", cell("lift_s", "0"), Code.LIFT_WITHOUT_CARRIER),
    ("trips", "same limit twice", again(cusum="80"), Code.DUPLICATE_ID),
    ("writables", "tag unknown", cell("tag", "T99"), Code.UNKNOWN_TAG),
    ("writables", "a measured tag", again(tag="T1"), Code.NOT_COMMANDABLE),
    ("writables", "row lost", without_first, Code.TAG_NOT_WRITABLE),
    ("writables", "tolerance negative", cell("tolerance", "-1"), Code.BAD_NUMBER),
    ("writables", "tolerance of an increment", cell("tolerance", "0.1"), Code.BAD_NUMBER),
    ("writables", "never confirmed", cell("confirm_s", "0"), Code.BAD_NUMBER),
    ("writables", "ramped by nobody", cell("ramped_by", "wind"), Code.BAD_WORD),
    ("writables", "neither yes nor no", cell("automatic", "maybe"), Code.MISSING_VALUE),
    ("writables", "no automatic where a state asks for it", where(lambda r: r["tag"] == "V2.man", automatic="no"), Code.TAG_NOT_WRITABLE),
    ("writables", "same tag twice", again(confirm_s="9"), Code.DUPLICATE_ID),
    ("start_up", "limit unknown", cell("limit", "LIM-99"), Code.UNKNOWN_LIMIT),
    ("start_up", "not a hard limit", cell("limit", "LIM-T-LOW"), Code.UNKNOWN_LIMIT),
    ("start_up", "a criterion", cell("limit", "ACC-T-HIGH"), Code.UNKNOWN_LIMIT),
    ("start_up", "formula missing", cell("formula", ""), Code.MISSING_VALUE),
    ("start_up", "formula names an unknown tag", cell("formula", "T99 <= 3"), Code.UNKNOWN_TAG),
    ("start_up", "outside the instrument", cell("formula", "T1 <= 5000"), Code.LIMIT_OUTSIDE_RANGE),
    ("start_up", "protects nothing", cell("formula", "abs(V1.cmd) <= 1"), Code.LIMIT_NEVER_VIOLATED),
    ("start_up", "looks ahead", cell("formula", "always (T1 <= 356)"), Code.LIMIT_LOOKS_AHEAD),
    ("start_up", "source missing", cell("source", ""), Code.MISSING_VALUE),
    ("states", "start-up neither yes nor no", cell("start_up", "maybe"), Code.MISSING_VALUE),
    ("states", "start-up for ever", cell("start_up_s", ""), Code.MISSING_VALUE),
    ("states", "start-up of a week", cell("start_up_s", "604800"), Code.BAD_NUMBER),
    ("states", "start-up in no time", cell("start_up_s", "0"), Code.BAD_NUMBER),
    ("states", "a longest start-up of a state that is none", where(lambda r: r["id"] == "holding", start_up_s="60"), Code.BAD_SHAPE),
    ("faults", "component unknown", cell("component", "J99"), Code.UNKNOWN_COMPONENT),
    ("faults", "disables something unknown", cell("disables", "J99"), Code.UNKNOWN_COMPONENT),
    ("faults", "range reversed", swapped("low", "high"), Code.REVERSED_RANGE),
    ("faults", "nominal outside", cell("nominal", "1e6"), Code.SEVERITY_OUTSIDE_RANGE),
    ("faults", "prior is no number", cell("prior", "often"), Code.BAD_NUMBER),
    ("faults", "prior negative", cell("prior", "-0.1"), Code.BAD_SHAPE),
    ("faults", "unit missing", cell("severity_unit", ""), Code.MISSING_VALUE),
    ("faults", "row lost", without_first, Code.UNKNOWN_FAULT),
    ("faults", "unknown to the model", again(id="no_such"), Code.UNKNOWN_FAULT),
    ("faults", "same id twice", again(prior="0.01"), Code.DUPLICATE_ID),
    ("features", "expression names an unknown tag", cell("expression", "T99 - 3"), Code.UNKNOWN_TAG),
    ("features", "accumulation names an unknown tag", cell("accumulation", "T99 * 3"), Code.UNKNOWN_TAG),
    ("features", "syntax", cell("expression", "T1 -"), Code.BAD_FORMULA),
    ("features", "a condition instead of a term", cell("expression", "T1 <= 3"), Code.BAD_FORMULA),
    ("features", "component unknown", cell("component", "V99"), Code.UNKNOWN_COMPONENT),
    ("features", "window negative", cell("window_s", "-5"), Code.BAD_SHAPE),
    ("features", "window without an accumulation", where(lambda r: not r["accumulation"], window_s="60"), Code.BAD_SHAPE),
    ("features", "accumulation without a window", where(lambda r: not r["accumulation"], accumulation="T1"), Code.BAD_SHAPE),
    ("features", "row lost", without_first, Code.UNKNOWN_FEATURE),
    ("features", "same id twice", again(unit="furlong"), Code.DUPLICATE_ID),
    ("symptoms", "feature unknown", cell("feature", "F-99"), Code.UNKNOWN_FEATURE),
    ("symptoms", "direction unknown", cell("direction", "up"), Code.BAD_WORD),
    ("symptoms", "sigma is no number", cell("sigma", "many"), Code.BAD_NUMBER),
    ("symptoms", "sigma negative", cell("sigma", "-8"), Code.BAD_SHAPE),
    ("symptoms", "on-delay missing", cell("on_delay_s", ""), Code.MISSING_VALUE),
    ("symptoms", "row lost", without_first, Code.BAD_SHAPE),
    ("symptoms", "same id twice", again(sigma="99"), Code.DUPLICATE_ID),
    ("symptom_faults", "fault unknown", cell("fault", "gremlin"), Code.UNKNOWN_FAULT),
    ("symptom_faults", "symptom unknown", cell("symptom", "S-99"), Code.SYMPTOM_WITHOUT_FAULT),
    ("symptom_faults", "no symptom for a fault", without("fault"), Code.FAULT_WITHOUT_SYMPTOM),
    ("symptom_faults", "no fault for a symptom", without("symptom"), Code.SYMPTOM_WITHOUT_FAULT),
]  # fmt: skip
