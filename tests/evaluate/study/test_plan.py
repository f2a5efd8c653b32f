"""Files of studies: those that are wrong are refused in one line, before anything is written."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from homeostat.cli.main import main
from homeostat.evaluate.study.plan.expansion import jobs_of
from homeostat.evaluate.study.plan.plan import read_plan, seeds_of
from tests.cli.command import environment

SHIPPED = Path(__file__).parents[3] / "campaigns"
CSTR = '[[scenarios]]\ncase = "cstr"\n'
LEAK = CSTR + 'fault = "leak"\n'
BATCH = '[[scenarios]]\ncase = "mixing_module"\n'


def listed(names: str, *more: str) -> str:
    return "\n".join((CSTR + 'name = "some"', f"fault = [{names}]", *more))


BAD = [
    ("no TOML", "title = 'Bad' x", ("no TOML", "line 1")),
    ("a number without end", f"seeds = {'9' * 5000}", ("no TOML", "digits")),
    ("nothing", "", ("title: missing; state it; and 1 more",)),
    ("no scenario", "scenarios = []", ("scenarios", "at least 1 item")),
    ("a scenario without a plant", "[[scenarios]]\nname = 'x'", ("scenario 1, case: missing; state it",)),
    ("an unknown key", f"sedes = 3\n{CSTR}", ("sedes: there is no such key; did you mean 'seeds'", "keep")),
    ("an unknown key of a scenario", f"{CSTR}{LEAK}onset = 3.0", ("scenario 2, onset", "did you mean 'onset_s'")),
    ("an unknown key of a proposer", f"proposers = [{{ who = 'search', nmae = 'a' }}]\n{CSTR}",
     ("proposer 1, nmae", "did you mean 'name'", "then_search")),
    ("an unknown plant", '[[scenarios]]\ncase = "csrt"', ("unknown plant 'csrt'; did you mean 'cstr'",)),
    ("a plant outside", '[[scenarios]]\ncase = "../cases/cstr"', ("unknown plant '../cases/cstr'",)),
    ("a proposer's unknown plant", f"proposers = [{{ who = 'search', cases = ['csrt'] }}]\n{CSTR}", ("did you mean",)),
    ("an unknown fault", CSTR + 'fault = "leek"', ("scenario 'leek' of 'cstr'", "did you mean 'leak'")),
    ("an unknown fault that is not drawn", "seeds = [1]\n" + listed('"leak", "fouling", "leek"'), ("'some'", "'leek'")),
    ("an unknown location", BATCH + 'fault = "clogging"\nlocation = "B999"', ("'B999'", "it can be at")),
    ("a location of no fault", BATCH + 'location = "B201"', ("location 'B201' needs exactly one fault",)),
    ("a fault twice", CSTR + 'fault = "leak+leak"', ("names a fault twice",)),
    ("a fault twice in a list", listed('"leak", "leak"'), ("scenario 1", "names each once")),
    ("a fault twice in a draw", "seeds = 9\n" + listed('"leak+fouling", "leak"', "draw = 2"), ("names a fault twice",)),
    ("no fault in a list", listed('"leak", "none"'), ("not 'none'",)),
    ("an empty list of faults", listed(""), ("the list of faults is empty; name one at least",)),
    ("a list without name", CSTR + 'fault = ["leak"]', ("needs a name for the tables",)),
    ("too many drawn", listed('"leak", "fouling"', "draw = 3"), ("3 faults cannot be drawn from 2",)),
    ("far too many drawn", listed('"leak"', "draw = 99"), ("scenario 1, draw", "less than or equal to 4", "99")),
    ("one fault drawn twice", LEAK + "draw = 2", ("2 faults cannot be drawn from 1",)),
    ("half a fault drawn", listed('"leak"', "draw = 1.5"), ("scenario 1, draw", "1.5")),
    ("an unknown fault that nobody has", CSTR + "unknown = true", ("nothing that could be unknown",)),
    ("a severity out of range", LEAK + "severity = 0.5", ("scenario 'leak' of 'cstr'", "0.0002 to 0.02 1/s")),
    ("severities of which some are out of range", "seeds = [1]\n" + LEAK + "severity = [0.001, 0.5]", ("0.02 1/s",)),
    ("severities the wrong way round", LEAK + "severity = [0.02, 0.01]", ("scenario 1, severity", "lower end first")),
    ("a severity of no fault", CSTR + "severity = 0.5", ("needs exactly one fault",)),
    ("a severity in words", LEAK + 'severity = "large"', ("scenario 1, severity", "'any'", "given: 'large'")),
    ("a severity that is no number", LEAK + "severity = nan", ("scenario 1, severity: ", "finite", "(given: nan)\n")),
    ("severities for ever", LEAK + "severity = [0.001, inf]", ("scenario 1, severity 2: ", "finite", "(given: inf)\n")),
    ("three severities", LEAK + "severity = [0.001, 0.002, 0.003]", ("scenario 1, severity", "at most 2")),
    ("an onset that is no number", LEAK + "onset_s = nan", ("scenario 1, onset_s", "finite", "nan")),
    ("an onset after the end", LEAK + "onset_s = 7000.0", ("onset 7000 s must lie in the run, 0 s to 6000 s",)),
    ("onsets of which some are after the end", "seeds = [1]\n" + LEAK + "onset_s = [1.0, 7000.0]", ("onset 7000 s",)),
    ("onsets the wrong way round", LEAK + "onset_s = [9.0, 1.0]", ("scenario 1, onset_s", "lower end first")),
    ("an onset of no fault", CSTR + "onset_s = 100.0", ("onset 100 s needs a fault",)),
    ("an end that never comes", CSTR + "end_s = inf", ("scenario 1, end_s", "finite")),
    ("an end too late", CSTR + "end_s = 1e9", ("end of the run 1e+09 s", "86400 s")),
    ("an end at once", CSTR + "end_s = 0", ("end of the run 0 s",)),
    ("no seed", f"seeds = 0\n{CSTR}", ("seeds: there must be 1 to 10000 seeds", "given: 0")),
    ("less than no seed", f"seeds = -3\n{CSTR}", ("1 to 10000 seeds", "-3")),
    ("seeds for ever", f"seeds = 1000000000000\n{CSTR}", ("1 to 10000 seeds",)),
    ("an empty list of seeds", f"seeds = []\n{CSTR}", ("1 to 10000 seeds",)),
    ("a scenario without seeds", f"{CSTR}{LEAK}seeds = 0", ("scenario 2, seeds", "1 to 10000")),
    ("a scenario with no seed", f"{CSTR}{LEAK}seeds = []", ("scenario 2, seeds", "1 to 10000")),
    ("a scenario with seeds for ever", f"{LEAK}seeds = 100000000000", ("scenario 1, seeds", "1 to 10000")),
    ("a negative seed", f"seeds = [1, -1]\n{CSTR}", ("seeds: seed -1 must lie in 0 to 4294967295",)),
    ("a seed too large", f"seeds = [4294967296]\n{CSTR}", ("4294967296 must lie in 0 to 4294967295",)),
    ("a seed twice", f"seeds = [1, 2, 1]\n{CSTR}", ("seeds: a seed is there twice",)),
    ("a seed in words", f'seeds = "three"\n{CSTR}', ("seeds", "valid integer", "'three'")),
    ("half a seed", f"seeds = 1.5\n{CSTR}", ("seeds", "1.5")),
    ("true seeds", f"seeds = true\n{CSTR}", ("seeds",)),
    ("an empty name", CSTR + 'name = ""', ("scenario 1, name", "at least 1 character")),
    ("a name with a path", CSTR + 'name = "a/b"', ("scenario 1, name", "match pattern", "'a/b'")),
    ("a name of two lines", CSTR + 'name = "a\\nb"', ("scenario 1, name", r"'a\nb'")),
    ("a name with a backslash", CSTR + 'name = "a\\\\b"', ("scenario 1, name",)),
    ("a name too long", CSTR + f'name = "{"n" * 81}"', ("scenario 1, name", "at most 80")),
    ("a value of great length", CSTR + f'name = "{"/" * 5000}"', ("scenario 1, name", "...")),
    ("a proposer's name with a path", f"proposers = [{{ who = 'search', name = '../x' }}]\n{CSTR}",
     ("proposer 1, name", "'../x'")),
    ("two scenarios of one name", LEAK + LEAK, ("scenario 'cstr leak' is there twice; give one another name",)),
    ("two proposers of one name", f"proposers = ['search', 'search']\n{CSTR}",
     ("proposer 'search in cstr' is there twice",)),
    ("an ablation twice", f"ablations = ['none', 'none']\n{CSTR}", ("ablation 'none' is there twice",)),
    ("names that are one as a folder", f"{LEAK}name = 'a b'\n{LEAK}name = 'a-b'", ("'cstr~a-b~1~search~none'",)),
    ("an unknown ablation", f"ablations = ['no-grap']\n{CSTR}", ("no ablation 'no-grap'", "no-graph")),
    ("no ablation", f"ablations = []\n{CSTR}", ("ablations", "at least 1")),
    ("an ablation that matters to nobody", f"ablations = ['no-graph']\n{CSTR}", ("there is nothing to run",)),
    ("no proposer", f"proposers = []\n{CSTR}", ("proposers", "at least 1")),
    ("a proposer for another plant", f"proposers = [{{ who = 'search', cases = ['mixing_module'] }}]\n{CSTR}",
     ("there is nothing to run",)),
    ("an unknown proposer", f"proposers = ['serch']\n{CSTR}", ("proposer 'serch'", "search")),
    ("a proposer without name", f"proposers = ['']\n{CSTR}", ("proposer ''", "unknown proposer")),
    ("a proposer that is a number", f"proposers = [3]\n{CSTR}", ("proposer 1", "3")),
    ("an unknown script", f"proposers = ['scripted:wise']\n{CSTR}", ("'scripted:wise'", "scripted:reasonable")),
    ("a reference policy by another name", f"proposers = [{{ who = 'hindsight', name = 'best' }}]\n{CSTR}",
     ("proposer 1: reports know the reference policy 'hindsight' by that name; leave 'name' out",)),
    ("a proposer that is called a policy", f"proposers = [{{ who = 'constant', name = 'hindsight' }}]\n{CSTR}",
     ("proposer 1: reports would take 'constant' for 'hindsight'; choose another name",)),
    ("a proposer that is called the search", f"proposers = [{{ who = 'constant', name = 'search' }}]\n{CSTR}",
     ("proposer 1: reports would take 'constant' for 'search'",)),
    ("a proposer that is called recorded", f"proposers = [{{ who = 'search', name = 'replay:a' }}]\n{CSTR}",
     ("proposer 1: reports would take 'replay:a' for recorded or scripted",)),
    ("an unknown protocol", f"proposers = [{{ who = 'search', protocol = 'x' }}]\n{CSTR}", ("proposer 1, protocol",)),
    ("answers that are not there", f"proposers = ['replay:no.jsonl']\n{CSTR}", ("replay:no.jsonl", "No such file")),
    ("answers that are a folder", f"proposers = ['replay:.']\n{CSTR}", ("replay:.", "directory")),
    ("answers that are none", f"proposers = ['replay:bad.toml']\n{CSTR}", ("replay:bad.toml", "line 1")),
    ("no answers for any run", f"proposers = ['replay:{{seed}}.jsonl']\n{CSTR}", ("nothing to run", "answers")),
    ("a model whose name is no folder's", f"proposers = ['http://127.0.0.1:1/v1#{'m' * 300}']\n{CSTR}", ("200 bytes",)),
    ("values of no tag", f"proposers = [{{ who = 'constant', values = {{ 'F1.ps' = 0.02 }} }}]\n{CSTR}",
     ("proposer 'constant'", "'F1.ps'", "did you mean 'F1.sp'")),
    ("values that are no numbers", f"proposers = [{{ who = 'constant', values = {{ 'F1.sp' = nan }} }}]\n{CSTR}",
     ("proposer 1, values, F1.sp", "finite")),
    ("values for the search", f"proposers = [{{ who = 'search', values = {{ 'F1.sp' = 0.02 }} }}]\n{CSTR}",
     ("proposer 1", "'constant'", "'search' has no use")),
    ("both ways of thinking", f"thinking_measured = true\nthinking_declared_s = 1.0\n{CSTR}", ("not both",)),
    ("thinking backwards", f"thinking_declared_s = -1.0\n{CSTR}", ("thinking_declared_s", "-1.0")),
    ("thinking that is no number", f"thinking_declared_s = nan\n{CSTR}", ("thinking_declared_s", "nan")),
    ("an unknown way to keep", f"keep = 'some'\n{CSTR}", ("keep", "'failures', 'all' or 'none'")),
]  # fmt: skip


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    """What ``homeostat campaign arguments`` says: one line, and exit status 2."""
    assert main(["campaign", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("homeostat: ") and err.count("\n") == 1
    return err


@pytest.mark.parametrize(("content", "words"), [plant[1:] for plant in BAD], ids=[plant[0] for plant in BAD])
def test_refused_in_one_line_and_nothing_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], content: str,
    words: tuple[str, ...],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    Path("bad.toml").write_text(
        content if content.startswith("title") else f'title = "Bad"\n{content}' if content else ""
    )
    told = refusal(capsys, "bad.toml")
    for word in words:
        assert word in told
    assert len(told) < 1000
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


def test_a_file_that_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert "'no.toml' cannot be used: No such file" in refusal(capsys, "no.toml")
    assert "'.' cannot be used: Is a directory" in refusal(capsys, ".")
    Path("latin.toml").write_bytes('title = "Kühlung"\n'.encode("latin-1"))
    assert "'latin.toml' is no TOML" in refusal(capsys, "latin.toml")
    Path("deep.toml").write_text(f"title = {'[' * 100_000}")
    assert "'deep.toml' is no TOML" in refusal(capsys, "deep.toml")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["deep.toml", "latin.toml"]


def test_the_command_refuses_as_well(tmp_path: Path) -> None:
    (tmp_path / "bad.toml").write_text(f'title = "Bad"\nseeds = 0\n{CSTR}')
    arguments = [sys.executable, "-m", "homeostat", "campaign", "bad.toml"]
    done = subprocess.run(arguments, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=240)
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert "seeds: there must be 1 to 10000 seeds" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["bad.toml"]


def test_short_forms(tmp_path: Path) -> None:
    path = tmp_path / "short.toml"
    path.write_text(f'title = "Short"\n{CSTR}')
    plan = read_plan(path)
    assert (seeds_of(plan.seeds), plan.keep, plan.ablations, plan.thinking_declared_s) == (
        (1,),
        "failures",
        ("none",),
        1.0,
    )
    assert [job.name for job in jobs_of(plan, tmp_path)] == ["cstr~none~1~search~none"]
    path.write_text(
        'title = "Longer"\nseeds = [7, 5]\nthinking_measured = true\n'
        f"proposers = ['do-nothing', {{ who = 'scripted:reasonable', name = 'A model', cases = ['cstr'] }}]\n{LEAK}"
        "severity = 0.01\nonset_s = [900.0, 900.0]\nend_s = 1000\n"
    )
    jobs = jobs_of(read_plan(path), tmp_path)
    assert [job.name for job in jobs] == [
        "cstr~leak~7~do-nothing~none", "cstr~leak~7~scripted-A-model~none",
        "cstr~leak~5~do-nothing~none", "cstr~leak~5~scripted-A-model~none",
    ]  # fmt: skip
    assert {job.thinking.declared_s for job in jobs} == {None}
    (fault,) = jobs[0].scenario.faults
    assert (fault.fault, fault.severity, fault.onset_s, jobs[0].scenario.end_s) == ("leak", 0.01, 900.0, 1000.0)


def test_recorded_answers_are_found_beside_the_file_and_missing_ones_left_out(tmp_path: Path) -> None:
    path = tmp_path / "some.toml"
    path.write_text(
        f"title = 'Some'\nseeds = 3\nproposers = ['search', 'replay:{{case}}/{{scenario}}-{{seed}}.jsonl']\n{LEAK}"
    )
    (tmp_path / "cstr").mkdir()
    (tmp_path / "cstr" / "leak-2.jsonl").write_text("")
    replayed = [job for job in jobs_of(read_plan(path), tmp_path) if job.arm.model]
    assert [job.scenario.seed for job in replayed] == [2]
    assert replayed[0].arm.label == "replay:{case}/{scenario}-{seed}.jsonl"


@pytest.mark.parametrize(("name", "scenarios", "seeds"), [("quick", 4, 1), ("paper", 10, 10), ("robust", 13, 5)])
def test_the_shipped_campaigns(name: str, scenarios: int, seeds: int) -> None:
    jobs = jobs_of(read_plan(SHIPPED / f"{name}.toml"), SHIPPED)
    pairs = {(job.scenario.case, job.label, job.scenario.seed) for job in jobs}
    assert len(pairs) == scenarios * seeds
    names = [job.name for job in jobs]
    assert len(set(names)) == len(names) == len({job.fingerprint for job in jobs})
    for job in names:
        assert all(c.isalnum() or c in "._-+~" for c in job) and job not in (".", "..") and len(job) <= 200
    references = [job for job in jobs if job.arm.who in ("hindsight", "do-nothing", "fallback-only")]
    known = {job.arm.who for job in references}
    assert known >= {"hindsight", "do-nothing"} and len(references) == len(known) * len(pairs)
    assert {job.ablation for job in references} == {"none"}
