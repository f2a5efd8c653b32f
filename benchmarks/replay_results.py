"""Judge recorded language-model answers again, and write ``docs/results/replay.md``.

    python -m benchmarks.replay_results [--records FILE]

First on the published plant under the published rules, then in the same situation on this project's reactor under its
own checks. Takes five to ten minutes on one core; needs the records, which are not part of this project.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.cstr_results import ROOT
from benchmarks.host import measured_on
from benchmarks.published_rules import Replayed, outside_s, replay
from benchmarks.recorded_calls import FILE, Reason, Setpoints, by_run, read_calls, repeats
from benchmarks.replay_answers import answer_rows
from benchmarks.replay_ours import ENDS_S, Course, Ours, idle, ours, situation, typed
from homeostat.domain.verdict import Finding
from homeostat.plants.plant import load_plant

PAGE = ROOT / "docs" / "results" / "replay.md"
REASONS = {
    ("fouling", True): "Published: a second is unsafe where the cooling valve is open 95 % or more and one noisy"
    " reading is over 0.5 K from 310 K, and a fifth of the seconds may be; a reading broke a limit in {limit} s. Ours:"
    " margin to the limits, as true values over 900 s, and a review within those; what a loop is off its setpoint has a"
    " price.",
    ("pump_degrade", False): "Half the pump is gone and the level setpoint goes up, so that liquid runs over the weir."
    " The published rules forgive the first minute and a fifth of the time. Ours forgive nothing, and the engineering"
    " tables admit a level setpoint of 10.4 L at most.",
    ("cool_stuck_closed", False): "With the valve stuck at 30 % the reactor settles at the limit and over 2 K above its"
    " setpoint; noise decides the published verdict. Ours ask for 0.3 K of margin.",
}
"""(Fault, accepted by ours) -> why the published rules say otherwise."""
OTHERS = {"pump_degrade": (Setpoints(310.0, 9.5, 1.0 / 30.0),), "cool_stuck_closed": (Setpoints(310.0, 10.0, 0.022),)}
"""What nobody proposed: the level down instead of up, and another step of feed."""
Found = Mapping[tuple[str, Setpoints | None], Ours]
"""Run and setpoints, None for no change -> what our checks say."""
Rows = list[Sequence[object]]
TEXT = """# The reactor: recorded language-model answers, judged again

Made by `python -m benchmarks.replay_results`. Material: {calls} calls in {runs} runs; of the two published studies on
the reactor, {campaigns}. Each record has the model that was served, its answer and the published verdict; the
records are not part of this project. A model was shown the plant once, at the second in which the published monitoring
reported the fault, and asked up to six times for three setpoints. The published validator simulated each answer to the
end of the run.

{measured}

## Under the published rules

The published plant with its noise on this project's kernel, and the published rules as formulas of the rule language
([published_rules.py](../../benchmarks/published_rules.py)). The temperature that the models were shown is met to
{off:.0e} K. `tests/reference/test_recorded_calls.py` pins all of it.

| fault | served | runs | calls | recorded: yes / no | replayed | same reason | same time to safe | same fraction |
|---|---|---|---|---|---|---|---|---|
{published}

Repetition: the published loop multiplied the feed by 0.9 where a proposal was what it had simulated last, and simulated
that. Ours refuses a proposal that was judged before, without simulating it (CHK-REPEATED).

| fault | proposals | distinct | repeats in their run | accepted as answered | accepted as changed by rule |
|---|---|---|---|---|---|
{repeated}

## Under our checks

The same proposals in the same situation: same fault of nominal size, same onset, same second. Not the same noise: our
plants draw their parameters (seed: number of the run), their feed is mixed upstream, and their level loop may slow the
pump as well as speed it up. So the proposals are judged again, not the records. Until the recorded second our
monitoring watches and diagnoses, and nothing is done; our loop would have acted long before. At that second its
diagnosis names the injected fault first in {right} of {runs} runs. Commands are ramped at the rates of the signal list
and lead to the first recovery target that admits them. Rollouts cover {horizon} s, every plausible hypothesis and
{draws} parameter draws each.

| fault | proposals | accepted | refused |
|---|---|---|---|
{faults}

Why (a proposal may violate several criteria; a margin in scales is of a criterion that mixes units, for T1.err 1 K):

| fault | asks for | proposals | worst margin |
|---|---|---|---|
{criteria}

Every combination that was simulated, with how often it was accepted. *By rule*: its feed was changed by the rule for
repetition. *No change*: the plant is left alone. *Not proposed*: chosen for comparison. Both once per run, in brackets.
The last four columns are true values of our plant with the setpoints executed whatever the verdict: over {horizon} s
the highest temperature and level and the seconds outside (above 313 K, above 11 L, below 2 L), and the seconds outside
up to {end} s with nothing else done.

| fault | setpoints | calls | published | ours | state | least margin | top [K] | top [L] | outside [s] | later [s] |
|---|---|---|---|---|---|---|---|---|---|---|
{setpoints}

## Where they disagree

About the same setpoints both say the same in {same} of {calls} calls. The others, with the *published* plant from the
call to {end} s (unsafe: as the published rules count; hottest and outside: true values):

| fault | setpoints | calls | published | ours | unsafe [s] | hottest [K] | outside [s] | why |
|---|---|---|---|---|---|---|---|---|
{disagreements}

## As typed answers

The recorded answers said again by a `ReplayModel`, and read as answers of today's action agent. Its schema admits whole
increments inside the bounds of the target state; in `compensated` the feed is fixed and not asked for. What is not
admitted is not simulated: it is a finding that goes back to the model, and a model whose decoding follows the schema
could not have said it.

| fault | target state | answers | admitted | why not (number of answers) |
|---|---|---|---|---|
{answers}

## A limit of our twin

At the recorded second, from the last {replay} s alone and without the diagnoses made on the way, the twin takes
{mistaken}. A fault that is much older than the stretch that is replayed has no onset in it.
"""


def grouped(replayed: Sequence[Replayed], key: Callable[[Replayed], Any]) -> dict[Any, list[Replayed]]:
    return {k: [r for r in replayed if key(r) == k] for k in dict.fromkeys(key(r) for r in replayed)}


def lines(rows: Rows) -> str:
    return "\n".join("| " + " | ".join(str(c) for c in row) + " |" for row in rows)


def span(values: Iterable[int]) -> str:
    several = sorted(values)
    return f"{several[0]}" if several[0] == several[-1] else f"{several[0]} to {several[-1]}"


def said(finding: Finding) -> str:
    unit = "scales" if finding.unit == "1" else finding.unit
    return f"{finding.criterion} {finding.margin:+.2g} {unit} at {finding.at_s:.0f} s"


def shown(wanted: Setpoints, group: Sequence[Replayed]) -> str:
    return f"{wanted} (by rule)" if any(r.call.nudged for r in group) else f"{wanted}"


def published_lines(replayed: Sequence[Replayed]) -> str:
    rows: Rows = []
    for (fault, model), rs in grouped(replayed, lambda r: (r.call.fault, r.call.model_served)).items():
        recorded, now = sum(r.call.accepted for r in rs), sum(r.judgement.reason is Reason.PASS for r in rs)
        same = sum(r.judgement.reason is r.call.reason for r in rs)
        times = sum(r.judgement.time_to_safe_s == r.call.time_to_safe_s for r in rs)
        seconds = sum(r.judgement.unsafe_fraction == r.call.unsafe_fraction for r in rs)
        runs, n = len({r.call.run_id for r in rs}), len(rs)
        rows.append((fault, model, runs, n, f"{recorded} / {n - recorded}", f"{now} / {n - now}", same, times, seconds))
    return lines(rows)


def repeat_lines(replayed: Sequence[Replayed]) -> str:
    rows: Rows = []
    for fault, rs in grouped(replayed, lambda r: r.call.fault).items():
        calls = [r.call for r in rs]
        own, changed = ([c for c in calls if c.nudged is flag] for flag in (False, True))
        accepted = [f"{sum(c.accepted for c in group)} of {len(group)}" for group in (own, changed)]
        rows.append((fault, len(calls), len({c.proposed for c in calls}), len(repeats(calls)), *accepted))
    return lines(rows)


def cause_lines(replayed: Sequence[Replayed], found: Found, asks: Mapping[str, str]) -> tuple[str, str]:
    """Per fault, and per fault and criterion: what our checks say to the proposals as they were answered."""
    faults: Rows = []
    criteria: Rows = []
    for fault, rs in grouped(replayed, lambda r: r.call.fault).items():
        verdicts = [found[r.call.run_id, r.call.proposed] for r in rs]
        refused = [v for v in verdicts if v.violated]
        faults.append((fault, len(rs), len(rs) - len(refused), len(refused)))
        violated = [f for v in refused for f in v.violated]
        for name, count in Counter(f.criterion for f in violated).most_common():
            worst = min((f for f in violated if f.criterion == name), key=lambda f: f.margin)
            criteria.append((fault, asks.get(name, "Setpoint inside the state's range"), count, said(worst)))
    return lines(faults), lines(criteria)


def setpoint_lines(replayed: Sequence[Replayed], found: Found, scales: Mapping[str, float]) -> str:
    """Per fault and setpoints that were simulated, and per fault without any change: both verdicts, and our plant."""
    rows: Rows = []
    for fault, rs in grouped(replayed, lambda r: r.call.fault).items():
        for wanted, group in grouped(rs, lambda r: r.call.evaluated).items():
            verdicts = [found[r.call.run_id, wanted] for r in group]
            accepted = sum(r.call.accepted for r in group), sum(not v.violated for v in verdicts)
            rows.append((fault, shown(wanted, group), len(group), *accepted, *executed(verdicts, scales)))
        for wanted in (None, *OTHERS.get(fault, ())):
            verdicts = [found[name, wanted] for name in grouped(rs, lambda r: r.call.run_id)]
            text = f"{wanted} (not proposed)" if wanted else "no change"
            ok = sum(not v.violated for v in verdicts)
            rows.append((fault, text, f"({len(verdicts)})", "-", ok, *executed(verdicts, scales)))
    return lines(rows)


def executed(verdicts: Sequence[Ours], scales: Mapping[str, float]) -> Sequence[object]:
    worst = min((v.worst for v in verdicts), key=lambda f: f.relative(scales))
    top = (max(v.soon.temperature.max() for v in verdicts), max(v.soon.level.max() for v in verdicts))
    outside = span(v.soon.outside_s for v in verdicts), span(v.late.outside_s for v in verdicts)
    return verdicts[0].target, said(worst), *(f"{value:.2f}" for value in top), *outside


def disagreement_lines(replayed: Sequence[Replayed], found: Found) -> str:
    """Where the published rules and our checks say different things about the same setpoints."""
    rows: Rows = []
    pairs = grouped(replayed, lambda r: (r.call.fault, r.call.evaluated, r.call.accepted))
    for (fault, wanted, theirs), group in pairs.items():
        if not (differ := [r for r in group if theirs == bool(found[r.call.run_id, wanted].violated)]):
            continue
        true = [Course(r.course.true_temperature, r.course.signals["L1"]).until(ENDS_S - r.call.time_s) for r in differ]
        why = REASONS.get((fault, not theirs), "-").format(limit=span(outside_s(r.course) for r in differ))
        rows.append((
            fault, shown(wanted, differ), f"{len(differ)} of {len(group)}", "accepted" if theirs else "refused",
            "refused" if theirs else "accepted", span(r.judgement.unsafe_s for r in differ),
            f"{max(t.temperature.max() for t in true):.2f}", span(t.outside_s for t in true), why,
        ))  # fmt: skip
    return lines(rows)


def page(replayed: Sequence[Replayed], found: Found, diagnosed: Mapping[str, tuple[str, str]]) -> str:
    """The results page; ``diagnosed``: run -> most probable fault, and the same without the earlier diagnoses."""
    plant = load_plant("cstr")
    d, truth = plant.description, {r.call.run_id: r.call.fault for r in replayed}
    asks = {c.name: c.description for c in d.limits.criteria} | {x.name: x.description for x in d.limits.limits}
    faults, criteria = cause_lines(replayed, found, asks)
    lost = Counter((fault, diagnosed[name][1]) for name, fault in truth.items() if diagnosed[name][1] != fault)
    return TEXT.format(
        measured=measured_on("src", "benchmarks"),
        calls=len(replayed), runs=len(truth), campaigns=" and ".join(sorted({r.call.experiment for r in replayed})),
        end=ENDS_S, horizon=plant.twin.horizon_s, draws=plant.twin.judged_draws, replay=plant.twin.replay_s,
        off=max(abs(r.shown.temperature - r.call.shown.temperature) for r in replayed),
        published=published_lines(replayed), repeated=repeat_lines(replayed), faults=faults, criteria=criteria,
        right=sum(diagnosed[name][0] == fault for name, fault in truth.items()),
        setpoints=setpoint_lines(replayed, found, d.scales), disagreements=disagreement_lines(replayed, found),
        same=sum(r.call.accepted != bool(found[r.call.run_id, r.call.evaluated].violated) for r in replayed),
        answers=lines(answer_rows(plant, [r.call for r in replayed])),
        mistaken=", ".join(f"{fault} for {taken} in {n} runs" for (fault, taken), n in lost.items()) or "nothing amiss",
    )  # fmt: skip


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--records", type=Path, default=FILE, help="file of recorded calls")
    records = parser.parse_args().records
    if not records.is_file():
        parser.error(f"{records} is no file of recorded calls; name one with --records")
    runs = by_run(read_calls(records))
    plant = load_plant("cstr")
    found: dict[tuple[str, Setpoints | None], Ours] = {}
    diagnosed: dict[str, tuple[str, str]] = {}
    for name, calls in runs.items():
        where = situation(plant, calls[0])
        diagnosed[name] = where.diagnosis.hypotheses[0].name, where.unprepared
        found[name, None] = ours(plant, where, idle())
        answers = [s for c in calls for s in (c.proposed, c.evaluated)]
        for wanted in dict.fromkeys((*answers, *OTHERS.get(calls[0].fault, ()))):
            found[name, wanted] = ours(plant, where, typed(plant, where.snapshot, wanted))
        print(name, diagnosed[name], flush=True)
    PAGE.write_text(page([r for calls in runs.values() for r in replay(calls)], found, diagnosed), encoding="utf-8")


if __name__ == "__main__":
    main()
