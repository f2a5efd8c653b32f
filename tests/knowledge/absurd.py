"""Values that a table can hold and a plant cannot have, each with the words of the line that refuses it."""
# ruff: noqa: E501  (a table of mistakes reads best with one mistake per line)

from __future__ import annotations

from homeostat.knowledge.store.error import Code
from tests.knowledge.mistakes import Change, cell, where

TRIP, BACK = "trip of limit 'LIM-T-HIGH'", "fallback 'drain', limit 'LIM-T-HIGH'"
NEVER, NUMBER = Code.LIMIT_NEVER_VIOLATED, Code.BAD_NUMBER


def limit(formula: str, name: str = "LIM-T-HIGH") -> Change:
    """Another formula for a limit."""
    return where(lambda row: row["id"] == name, formula=formula)


def feed(low: str) -> Change:
    """Another lowest feed in the state of reduced load."""
    return where(lambda row: (row["state"], row["tag"]) == ("reduced_load", "F1.sp"), low=low)


ABSURD: list[tuple[str, Change, Code, str, str]] = [
    ("trips", cell("cusum", "1e9"), NUMBER, TRIP, "trips.csv, cusum 1e+09 K s is more than 20 K s, at which a violation by 1 K"),
    ("trips", cell("cusum", "10000"), NUMBER, TRIP, "cusum 10000 K s is more than 20 K s"),
    ("trips", cell("cusum", "20.1"), NUMBER, TRIP, "cusum 20.1 K s"),
    ("trips", cell("cusum", "1.6", 1), NUMBER, "trip of limit 'LIM-L-HIGH'", "more than 1.5 L s, at which the worst violation that can be shown, 3 L, lasts 0.5 s"),
    ("trips", cell("cusum", "9.6", 2), NUMBER, "trip of limit 'LIM-L-LOW'", "cusum 9.6 1 s is more than 9.5 1 s"),
    ("trips", cell("lift", "1e6"), NUMBER, TRIP, "trips.csv, lift 1e+06 K is more than 16.5 K, 15% of what the reading can vary by; lower it"),
    ("trips", cell("lift", "16.6"), NUMBER, TRIP, "lift 16.6 K"),
    ("trips", cell("carrier", "F3 <= 0.599"), NEVER, TRIP, "'F3 <= 0.599' can be violated by at most 0.001 L/s"),
    ("trips", cell("carrier", "F3 - F3 <= 0.1"), NEVER, TRIP, "holds for all values"),
    ("trips", cell("carrier", "F1.sp <= 0.03"), NEVER, TRIP, "reads commands only"),
    ("trips", cell("lead", "22"), NUMBER, TRIP, "trips.csv, lead 22 K is more than 21.5 K, 50% of the largest margin that can be shown; lower it"),
    ("fallbacks", cell("rate", "1.1"), NUMBER, "fallback 'drain'", "fallbacks.csv, rate 1.1 1/s of 'XV1.cmd' is more than 1 1/s, what writables.csv permits (fastest); lower it, or empty the cell"),
    ("fallbacks", cell("rate", "0.2", 3), NUMBER, "fallback 'drain'", "fallbacks.csv, rate 0.2 L/s of 'L1.sp' is more than 0.1 L/s, its ordinary rate (rate_limit in signals.csv); lower it"),
    ("fallbacks", cell("rate", "1e-8"), NUMBER, "fallback 'drain'", "fallbacks.csv, rate 1e-08 1/s is outside 1.15741e-05 to 1 1/s"),
    ("writables", where(lambda row: row["tag"] == "XV1.cmd", fastest="0.04"), NUMBER, "writable tag 'XV1.cmd'", "fastest 0.04 1/s must not be below its rate_limit in signals.csv, 0.05 1/s; correct or empty the cell"),
    ("writables", where(lambda row: row["tag"] == "T1.sp", fastest="18"), NUMBER, "writable tag 'T1.sp'", "writables.csv, fastest 18 K/s is outside"),
    ("fallback_limits", cell("rest", "1e9"), NUMBER, BACK, "fallback_limits.csv, rest 1e+09 K is more than 20 K, 20 times the scale of its tags; lower it"),
    ("fallback_limits", cell("rest", "1.6", 1), NUMBER, "fallback 'drain', limit 'LIM-L-HIGH'", "rest 1.6 L is more than 1.5 L, 50% of the worst violation"),
    ("quality", cell("noise", "1e8"), NUMBER, "quality of tag 'T1'", "quality.csv, noise 1e+08 K is outside 0.00011 to 2.2 K, what the range of 'T1', 270 to 380 K, allows; correct the cell"),
    ("quality", cell("noise", "1e-9"), NUMBER, "quality of tag 'T1'", "noise 1e-09 K is outside"),
    ("quality", cell("fastest", "1e9"), NUMBER, "quality of tag 'T1'", "fastest 1e+09 K/s is outside 0.00127315 to 110 K/s"),
    ("quality", cell("fastest", "1e-9"), NUMBER, "quality of tag 'T1'", "fastest 1e-09 K/s is outside"),
    ("quality", cell("grace_s", "0"), NUMBER, "quality of tag 'T1'", "grace_s 0 s doubts no step"),
    ("signals", where(lambda row: row["tag"] == "T1.sp", rate_limit="1e8"), NUMBER, "tag 'T1.sp'", "signals.csv, rate_limit 1e+08 K/s is outside 0.000196759 to 17 K/s"),
    ("signals", where(lambda row: row["tag"] == "T1.sp", rate_limit="1e-9"), NUMBER, "tag 'T1.sp'", "rate_limit 1e-09 K/s is outside"),
    ("writables", where(lambda row: row["tag"] == "XV1.cmd", tolerance="0.99"), NUMBER, "writable tag 'XV1.cmd'", "writables.csv, tolerance 0.99 is more than 0.02, 2% of its range; lower it"),
    ("writables", where(lambda row: row["tag"] == "XV1.cmd", tolerance="0.99"), NUMBER, "writable tag 'XV1.cmd'", "tolerance 0.99 is not less than 0.5: 0 and 1 are both commanded, and must be told apart; lower it"),
    ("setpoints", feed("0.0005"), NUMBER, "writable tag 'F1.sp'", "tolerance 0.00025 L/s is not less than 0.00025 L/s: 0 and 0.0005 L/s are both commanded"),
    ("symptoms", cell("threshold", "1e8"), NUMBER, "symptom 'S-V1-OFF'", "symptoms.csv, threshold 1e+08 is more than 1.05, 50% of what 'F-V1-POS' can vary by"),
    ("limits", limit("T1 <= T1"), NEVER, "limit 'LIM-T-HIGH'", "holds for all values inside the ranges of its tags"),
    ("limits", limit("T1 - T1 <= 1"), NEVER, "limit 'LIM-T-HIGH'", "holds for all values"),
    ("limits", limit("abs(T1) - abs(T1) <= 1"), NEVER, "limit 'LIM-T-HIGH'", "holds for all values"),
    ("limits", limit("0 * T1 <= 1"), NEVER, "limit 'LIM-T-HIGH'", "holds for all values"),
    ("limits", limit("T1 / T1 <= 2"), NEVER, "limit 'LIM-T-HIGH'", "holds for all values"),
    ("limits", limit("(T1 - 300) * (T1 - 300) >= 0"), NEVER, "limit 'LIM-T-HIGH'", "no values inside the ranges of its tags violate"),
    ("limits", limit("min(T1, T2) - T1 <= 0"), NEVER, "limit 'LIM-T-HIGH'", "no values inside the ranges of its tags violate"),
    ("limits", limit("T1 <= 313 or (T1 >= 312 or L1 >= 5)"), NEVER, "limit 'LIM-T-HIGH'", ""),
    ("limits", limit("T1 <= 313 or T1 >= 313.001"), NEVER, "limit 'LIM-T-HIGH'", "by more than 0.0005 K, and 5.5 K are needed"),
    ("limits", limit("T1 <= 379.9"), NEVER, "limit 'LIM-T-HIGH'", "'T1 <= 379.9' can be violated by at most 0.1 K inside the ranges of its tags, less than 5% of the 110 K that it can vary by, so it protects nothing; correct the value"),
    ("limits", limit("T1 <= 313 or L1 >= -1.9"), NEVER, "limit 'LIM-T-HIGH'", "'L1 >= -1.9' can be violated by at most 0.1 L"),
    ("limits", limit("not (T1 > 379.9)"), NEVER, "limit 'LIM-T-HIGH'", "'not (T1 > 379.9)' can be violated by at most 0.1 K"),
    ("limits", limit("L1 >= 5 implies T1 <= 379.9"), NEVER, "limit 'LIM-T-HIGH'", "'T1 <= 379.9' can be violated by at most 0.1 K"),
    ("limits", limit("T1.sp <= 310"), NEVER, "limit 'LIM-T-HIGH'", "reads commands only, so nothing that the plant does violates it; read a measured tag"),
    ("limits", limit("F1.sp <= F1.sp", "PRM-FEED"), NEVER, "limit 'PRM-FEED'", "holds for all values"),
    ("limits", limit("F1.sp <= 0.0499", "PRM-FEED"), NEVER, "limit 'PRM-FEED'", "at most 0.0001 L/s"),
    ("limits", limit("F1.sp - F1.sp >= 1", "PRM-FEED"), Code.GUARD_NEVER_TRUE, "limit 'PRM-FEED'", "cannot hold for any values"),
    ("start_up", cell("formula", "T1 <= 379.9"), NEVER, "start-up limit 'LIM-T-HIGH'", "'T1 <= 379.9' can be violated by at most 0.1 K"),
    ("start_up", cell("formula", "T1.sp <= 310"), NEVER, "start-up limit 'LIM-T-HIGH'", "reads commands only"),
    ("start_up", cell("formula", "T1 <= T1"), NEVER, "start-up limit 'LIM-T-HIGH'", "holds for all values"),
    ("start_up", cell("formula", "T1 <= 365"), NUMBER, TRIP, "cusum 10 K s is more than 7.5 K s"),
    ("limits", limit("1 / (T1 - T1) <= 1"), Code.BAD_FORMULA, "limit 'LIM-T-HIGH'", "divides by what may be 0 inside the ranges of its tags; multiply it out"),
    ("limits", limit("T1 <= 313 or T1 / 0 <= 1"), Code.BAD_FORMULA, "limit 'LIM-T-HIGH'", "divides by what may be 0"),
    ("criteria", where(lambda row: row["id"] == "ACC-T-HIGH", formula="always[180,900] (T1 <= 379.9)"), NEVER, "criterion 'ACC-T-HIGH'", "at most 0.1 K"),
]  # fmt: skip
"""Table, what is done to it, code, thing and words of the line."""
