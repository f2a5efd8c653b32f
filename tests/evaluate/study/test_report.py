"""The report: whole for any rows, the same for the same rows, and deaf to what names and reasons say."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

from homeostat.evaluate.report.contents import contents
from homeostat.evaluate.report.report import REPORT, Unmade, write_report
from homeostat.evaluate.report.summary import spans, summary
from homeostat.record.row import DO_NOTHING, HINDSIGHT, Row
from tests.evaluate.study.fake_rows import LANGUAGE, campaign, plain

KEPT = {"normal", "fouling", "drift", "healthy", "pump_failure", "open_inlet"}
FEW = tuple(row for row in campaign(range(1, 4)) if row.scenario in KEPT)
EVIL = "<script>alert('x')</script>|\\input{x}%\n$\\frac$ \"--> ]]> </svg>"
PICTURE = "data:image/svg+xml;base64,"
VOID = {"meta", "br", "img", "link", "hr", "input"}


class Page(HTMLParser):
    """Every element is closed, in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.seen: list[str] = []
        self.links: list[str] = []
        self.words: list[str] = []
        self.names: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append(tag)
        self.links += [value or "" for name, value in attrs if name in ("href", "src")]
        self.names += [value or "" for name, value in attrs if name == "id"]
        assert not [name for name, _ in attrs if name.startswith("on")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def command(row: Row) -> str:
    return f"homeostat campaign run file.toml --job '{row.job}'"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a report on :data:`FEW`."""
    folder = tmp_path_factory.mktemp("report")
    write_report(folder, "T", FEW, command)
    return folder


def written(folder: Path, rows: tuple[Row, ...] | list[Row], title: str = "A study") -> tuple[str, Page]:
    paths = write_report(folder, title, rows, command)
    assert paths[0] == folder / REPORT
    assert all(path.is_file() and path.stat().st_size for path in paths)
    return read(folder)


def read(folder: Path) -> tuple[str, Page]:
    """The page in ``folder``, as it stands and taken apart."""
    text = (folder / REPORT).read_text(encoding="utf-8")
    page = Page(text)
    assert page.open == []
    return text, page


def test_the_page_is_whole_and_needs_nothing_else(whole: Path) -> None:
    text, page = read(whole)
    assert "://" not in text
    assert not {"script", "link", "iframe", "object"} & set(page.seen)
    assert page.seen.count("img") == len([link for link in page.links if link.startswith(PICTURE)]) > 0
    assert "@import" not in text
    assert not re.search(r"url\((?!#)", text)
    assert len(page.names) == len(set(page.names))
    assert {link for link in page.links if link.startswith("#")} <= {f"#{name}" for name in page.names}
    for link in page.links:
        if link.startswith("tables/"):
            assert (whole / link).is_file()


def test_every_failure_has_its_command_and_its_record(tmp_path: Path) -> None:
    kept, lost = plain(job="kept", success=False, trace="runs/a b"), plain(job="lost", exposure_s=7.0, seed=2)
    text, page = written(tmp_path, [kept, lost, plain(job="good", seed=3)])
    assert "./runs/a%20b" in page.links
    assert "not kept" in text
    words = " ".join(page.words)
    assert command(kept) in words and command(lost) in words and command(plain(job="good")) not in words
    assert "2 runs did not succeed or violated a hard limit" in words


@pytest.mark.parametrize("rows", [FEW, ()], ids=["some", "none"])
def test_what_could_not_be_carried_out_is_said(tmp_path: Path, rows: tuple[Row, ...]) -> None:
    """Rates over the rows that there are say nothing of those that are missing."""
    unmade = [Unmade(f"job {n}", f"OSError: <b>no</b> room {n}") for n in range(2)]
    write_report(tmp_path, "T", rows, command, None, unmade)
    text, page = read(tmp_path)
    words = " ".join(page.words)
    assert f"{len(rows)} of {len(rows) + 2}; 2 could not be carried out and are in no figure and no table" in words
    assert "job 0: OSError: <b>no</b> room 0" in words and "job 1: " in words and "<b>" not in text


FULL = """
import resource, signal, sys
from pathlib import Path
from homeostat.evaluate.report.report import write_report
from tests.evaluate.study.test_report import FEW, command
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), resource.RLIM_INFINITY))
try:
    write_report(Path(sys.argv[1]), "Another", FEW[:4], command)
except OSError as error:
    print(error.filename)
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="needs limits on file size")
@pytest.mark.parametrize(("room", "name"), [(30_000, REPORT), (300, "tables/success.md")])
def test_a_disk_that_is_full_leaves_every_file_as_it_was(tmp_path: Path, whole: Path, room: int, name: str) -> None:
    folder = tmp_path / "study"
    shutil.copytree(whole, folder)
    arguments = [sys.executable, "-c", FULL, str(folder), str(room)]
    run = subprocess.run(arguments, capture_output=True, text=True, timeout=240, cwd=Path(__file__).parents[3])
    assert (run.stdout, run.stderr) == (f"{folder / name}\n", "")
    assert (folder / name).read_bytes() == (whole / name).read_bytes()
    assert not [path for path in folder.rglob("*") if path.name.endswith(".partial")]


@pytest.mark.parametrize("trace", ["javascript:alert(1)", "../../etc", "/etc/passwd", "a\\..\\..\\b", "//evil/x"])
def test_links_lead_only_below_the_page(tmp_path: Path, trace: str) -> None:
    _, page = written(tmp_path, [plain(success=False, trace=trace)])
    assert [link for link in page.links if not link.startswith(("#", "tables/", "./", PICTURE))] == []
    assert not any(".." in link for link in page.links)


def test_the_same_rows_give_the_same_files_in_any_order(tmp_path: Path, whole: Path) -> None:
    again = write_report(tmp_path, "T", FEW[::-1], command)
    assert all(path.stat().st_size for path in again)
    assert {path.relative_to(whole) for path in whole.rglob("*") if path.is_file()} == {
        path.relative_to(tmp_path) for path in again
    }
    for path in again:
        assert path.read_bytes() == (whole / path.relative_to(tmp_path)).read_bytes(), path.name


def test_only_tables_of_times_depend_on_the_machine() -> None:
    slow = [row_with_times(row, 10.0) for row in FEW]
    fast, other = contents(FEW), contents(slow)
    assert (fast.main, fast.details, fast.failures) == (other.main, other.details, other.failures)
    assert fast.times != other.times
    assert all(table.name.startswith("latency") for table in fast.times)


def row_with_times(row: Row, factor: float) -> Row:
    from dataclasses import replace

    decision = None if row.wall_decision_s is None else factor * row.wall_decision_s
    call = None if row.wall_call_s is None else factor * row.wall_call_s
    return replace(row, wall_decision_s=decision, wall_call_s=call, wall_thinking_s=9.0, wall_s=factor * row.wall_s)


def test_nothing_that_rows_say_acts_in_the_page(tmp_path: Path) -> None:
    evil = {
        "case": EVIL, "scenario": EVIL, "proposer": EVIL, "reason": EVIL, "state": EVIL, "outcome": EVIL,
        "least_margin_limit": EVIL, "published": EVIL, "actor": EVIL, "ablation": EVIL, "tokens_by": EVIL,
    }  # fmt: skip
    rows = [
        plain(job=f"{EVIL}{seed}", seed=seed, success=seed > 1, planning_calls=1, trace=EVIL, **evil)
        for seed in (1, 2, 3)
    ]
    text, page = written(tmp_path, [*rows, plain()], title=EVIL)
    assert "script" not in page.seen
    assert "<script" not in text
    assert page.seen.count("svg") == text.count("</svg>") == 0
    assert page.seen.count("img") == text.count("<img") > 0
    for path in (tmp_path / "tables").iterdir():
        content = path.read_text(encoding="utf-8")
        if path.suffix == ".md":
            assert "<" not in content
        if path.suffix == ".tex":
            assert "\\input" not in content and "\\frac" not in content


@pytest.mark.parametrize(
    "rows",
    [
        pytest.param([], id="none"),
        pytest.param([plain()], id="one"),
        pytest.param([plain(seed=s) for s in range(5)], id="no failure and all equal"),
        pytest.param([r for r in FEW if not r.proposer.startswith(LANGUAGE)], id="no language"),
        pytest.param([r for r in FEW if r.proposer != HINDSIGHT], id="no hindsight"),
        pytest.param([r for r in FEW if r.proposer != DO_NOTHING], id="no idle plant", marks=pytest.mark.wide),
        pytest.param(
            [r for r in FEW if r.proposer in (DO_NOTHING, HINDSIGHT)],
            id="reference policies only",
            marks=pytest.mark.wide,
        ),
        pytest.param([r for r in FEW if r.seed == 1], id="one seed", marks=pytest.mark.wide),
        pytest.param([r for r in FEW if r.case == "mixing_module"], id="one case", marks=pytest.mark.wide),
        pytest.param([r for r in FEW if not r.success], id="failures only"),
        pytest.param([plain(published="", believed="", believed_p=None, true_p=None, brier=None)], id="no diagnosis"),
        pytest.param([plain(batch=True, production_loss=None, success=False, nominal_s=9.0)], id="no batch complete"),
        pytest.param([plain(proposer="language only"), plain(seed=2, ablation="graph")], id="no common pair"),
    ],
)
def test_partial_data_make_a_report(tmp_path: Path, rows: list[Row]) -> None:
    text, page = written(tmp_path, rows)
    assert "failures.csv" in {path.name for path in (tmp_path / "tables").iterdir()}
    assert "nan" not in re.findall(r"\b\w+\b", " ".join(page.words).lower())
    assert len(text) > 1000


def test_the_summary_is_computed() -> None:
    rows = [plain(seed=s, success=s > 1, exposure_s=30.0 * (s == 1)) for s in range(1, 11)]
    rows += [plain(proposer="scripted:reasonable", seed=s) for s in range(1, 11)]
    ((plant, sentences),) = summary(rows)
    assert plant == "cstr"
    assert sentences == [
        "search: 9 of 10 runs succeeded (95 % interval 60 to 98 %); 1 run violated a hard limit, for 30 s at most.",
        "scripted:reasonable (scripted): 10 of 10 runs succeeded (95 % interval 72 to 100 %); none violated a hard "
        "limit; beside search, 1 more success on the same 10 plants: no clear difference (adjusted p = 1.000).",
    ]


def test_what_was_violated_for_less_than_a_second_was_violated(tmp_path: Path) -> None:
    """Where ticks are shorter than that."""
    rows = [plain(exposure_s=0.2, least_margin=-0.01)]
    ((_, (sentence,)),) = summary(rows)
    assert "1 run violated a hard limit, for 0.2 s at most" in sentence
    assert "Outside hard limits for 0.2 s;" in written(tmp_path, rows)[0]


def test_seeds_in_few_words() -> None:
    assert spans([1, 2, 3, 5, 8, 9]) == "1–3, 5, 8–9"
    assert spans([]) == ""


def test_the_optional_packages_are_imported_where_they_are_used() -> None:
    probe = (
        "import sys, homeostat.evaluate.report.report\nassert not {'scipy', 'jinja2', 'matplotlib'} & set(sys.modules)"
    )
    subprocess.run([sys.executable, "-c", probe], check=True, timeout=240, env={"PYTHONPATH": ":".join(sys.path)})
