"""A plant with code of its own: it runs under a private name, from what was read, after all else was checked."""

from __future__ import annotations

import logging
import re
import sys
from pathlib import Path

import pytest

from homeostat.evaluate.reference.unsupervised import open_process
from homeostat.evaluate.scenario import departing, scenario
from homeostat.journal.signing.keys import SigningKey, make_key, read_private
from homeostat.knowledge.store.error import GraphError
from homeostat.links.simulated import SimulatedLink
from homeostat.plants.error import PlantError
from homeostat.plants.files.code import import_own, modules
from homeostat.plants.files.folder import SIGNATURE, read_files
from homeostat.plants.files.signature import sign
from homeostat.plants.plant import Plant, load_plant
from homeostat.plants.truth import mismatches, true_model
from homeostat.process.model import written_in
from tests.plants.copies import Copy

MARK = "import pathlib\npathlib.Path({file!r}).write_text('ran')\n"


def own(where: Path, name: str = "boiler") -> Copy:
    """The reactor as somebody else's plant: its modules import each other, and nothing of the shipped one."""
    copied = Copy.of("cstr", where)
    folder = copied.folder.rename(where / name)
    for module in (*folder.glob("*.py"), *folder.glob("true/*.py")):
        up = ".." if module.parent.name == "true" else "."
        text = module.read_text("utf-8").replace("homeostat.plants.cstr.true.", ".")
        module.write_text(re.sub(r"homeostat\.plants\.cstr(?=[. ])\.?", up, text), "utf-8")
    copied = Copy(folder)
    copied.replace("case.toml", "homeostat.plants.cstr.process:REACTOR", "process:REACTOR")
    return copied


@pytest.fixture
def boiler(tmp_path: Path) -> Copy:
    return own(tmp_path)


def loaded(plant: Copy) -> Plant:
    """The plant without reference values: they would be learned again, because the code is another."""
    return load_plant(str(plant.folder), learned=False)


def marked(plant: Copy, module: str = "process.py") -> Path:
    """A file that is there once ``module`` has run."""
    file = plant.folder.parent / "ran.txt"
    text = plant.text(module)
    end = text.index('"""', 3) + 4
    (plant.folder / module).write_text(text[:end] + MARK.format(file=str(file)) + text[end:], "utf-8")
    return file


def test_it_runs_as_the_shipped_plant_does(boiler: Copy) -> None:
    theirs, ours = loaded(boiler), load_plant("cstr")
    assert written_in(theirs.model).startswith("_homeostat_plant_")
    assert written_in(theirs.model) != written_in(ours.model)
    assert true_model(theirs.model) is not None
    assert f"{written_in(theirs.model).rpartition('.')[0]}.true.plant" in sys.modules
    found = []
    for plant in (theirs, ours):
        chosen = departing(plant, scenario(plant, "temp_bias", 3, end_s=700.0, onset_s=500.0), mismatch="plant")
        link = SimulatedLink(open_process(plant, chosen))
        found.append([dict(link.advance().values) for _ in range(700)])
    assert repr(found[0]) == repr(found[1])


def test_two_plants_with_modules_of_the_same_names_do_not_meet(tmp_path: Path) -> None:
    first, second = own(tmp_path / "a"), own(tmp_path / "b")
    second.replace("process.py", "class Assumed", "OTHER = True\n\n\nclass Assumed")
    models = [loaded(plant).model for plant in (first, second)]
    known = [vars(sys.modules[written_in(model)]) for model in models]
    assert ["OTHER" in names for names in known] == [False, True]
    assert not {"process", "kernel", "layout", "boiler"} & sys.modules.keys()


def test_the_mismatches_are_those_that_were_read(boiler: Copy) -> None:
    model = loaded(boiler).model
    before = mismatches(model).keys()
    (boiler.folder / "true" / "mismatches.toml").write_text('[evil]\ndescription = "x"\n', "utf-8")
    assert mismatches(model).keys() == before and "plant" in before


@pytest.mark.parametrize(("text", "words"), [("1 / 0\n", "ZeroDivisionError"), ("x = 1\n", "defines no TRUE")])
def test_a_true_plant_that_cannot_be_run_is_one_line(boiler: Copy, text: str, words: str) -> None:
    (boiler.folder / "true" / "plant.py").write_text(text, "utf-8")
    with pytest.raises(PlantError, match=words):
        true_model(loaded(boiler).model)


def test_a_module_does_not_hide_the_true_plant(boiler: Copy) -> None:
    (boiler.folder / "true.py").write_text("x = 1\n", "utf-8")
    with pytest.raises(PlantError, match="has the name of the folder of the true plant; rename it"):
        loaded(boiler)


def test_what_changed_is_run_anew_and_what_did_not_is_not(boiler: Copy) -> None:
    first, again = loaded(boiler).model, loaded(boiler).model
    assert written_in(first) == written_in(again)
    boiler.replace("process.py", '"""', '"""Changed. ')
    assert written_in(loaded(boiler).model) != written_in(first)


def test_what_runs_is_what_was_read(boiler: Copy) -> None:
    """Not what somebody put there between the digest and the import."""
    files = read_files(boiler.folder)
    (boiler.folder / "process.py").write_text("raise SystemExit('altered')\n", "utf-8")
    assert hasattr(import_own(files, "process"), "REACTOR")


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("case.toml", "sure = 0.95", "sure = 1.95"),
        ("case.toml", "sure = 0.95", "shure = 0.95"),
        ("engineering/limits.csv", "T1 <= 313", "T1 <= 31x"),
        ("case.toml", "sure = 0.95", "settle_s = 6000"),
        ("case.toml", 'throughput = "F1"', 'throughput = "F99"'),
        ("plant.ttl", "313", "314"),
        ("baseline.csv", "0", "1"),
    ],
)
def test_nothing_of_it_runs_before_all_else_is_right(boiler: Copy, file: str, old: str, new: str) -> None:
    ran = marked(boiler)
    boiler.replace(file, old, new)
    with pytest.raises((PlantError, GraphError)):
        loaded(boiler)
    assert not ran.exists()


def test_whose_code_it_is_is_said_before_it_runs_and_once(boiler: Copy, caplog: pytest.LogCaptureFixture) -> None:
    ran = marked(boiler)
    seen: list[bool] = []
    caplog.handler.addFilter(lambda record: seen.append(ran.exists()) is None)
    with caplog.at_level(logging.WARNING):
        loaded(boiler)
        loaded(boiler)
    said = [r.getMessage() for r in caplog.records if "running the code" in r.getMessage()]
    assert len(said) == 1 and ran.exists() and seen[0] is False
    assert str(boiler.folder) in said[0] and "process.py" in said[0] and "true/plant.py" in said[0]
    assert "not signed" in said[0] and "\n" not in said[0]


def test_who_signed_it_is_said(boiler: Copy, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    make_key(tmp_path / "key")
    digest = loaded(boiler).configuration
    signature = sign("boiler", digest, "A. Keller", "review 7", SigningKey(read_private(tmp_path / "key")))
    (boiler.folder / SIGNATURE).write_text(signature.model_dump_json(), "utf-8")
    files = read_files(boiler.folder.rename(tmp_path / "moved"))
    with caplog.at_level(logging.WARNING):
        import_own(files, "process")
    assert "'A. Keller'" in caplog.messages[-1]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("x = 1 +\n", "process.py, line 1: SyntaxError"),
        ("import no_such_thing\n", "process.py, line 1: ModuleNotFoundError: No module named 'no_such_thing'"),
        ("\nraise ValueError('two\\nlines')\n", "process.py, line 2: ValueError: two lines"),
        ("from .layot import STATES\n", "process.py, line 1: ModuleNotFoundError"),
        ("from . import secret\n", "process.py, line 1: ImportError"),
        ("class REACTOR:\n    def initial_state(self): ...\n    def __init__(self): 1 / 0\n", "ZeroDivisionError"),
        ("x = 1\n", "defines no process model 'REACTOR'"),
        ("raise SystemExit(0)\n", "process.py, line 1: SystemExit: 0"),
        ("class REACTOR:\n    def initial_state(self): ...\n", "a process model has states, parameters"),
    ],
)
def test_code_that_cannot_be_run_is_one_line(boiler: Copy, text: str, words: str) -> None:
    (boiler.folder / "inner").mkdir()
    (boiler.folder / "inner" / "secret.py").write_text("", "utf-8")
    (boiler.folder / "process.py").write_text(text, "utf-8")
    with pytest.raises(PlantError) as caught:
        loaded(boiler)
    assert words in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("model", ["true.plant:TRUE", "os:system", "proces:REACTOR", "__init__:x"])
def test_only_modules_of_the_folder_itself_have_models(boiler: Copy, model: str) -> None:
    boiler.replace("case.toml", "process:REACTOR", model)
    with pytest.raises(PlantError, match="neither the folder nor a shipped plant provides the module"):
        loaded(boiler)


@pytest.mark.parametrize("name", ["process.py", "true/plant.py", "true/mismatches.toml", "engineering/limits.csv"])
def test_every_file_that_decides_what_runs_is_in_the_digest(boiler: Copy, name: str) -> None:
    before = loaded(boiler).configuration
    (boiler.folder / name).write_text(boiler.text(name) + "\n", "utf-8")
    assert loaded(boiler).configuration != before


@pytest.mark.parametrize("name", ["process.py", "case.toml", "engineering/limits.csv", "engineering", "true"])
def test_a_link_is_refused(boiler: Copy, tmp_path: Path, name: str) -> None:
    """What it leads to may be changed by people who may not change the folder."""
    elsewhere = (boiler.folder / name).rename(tmp_path / "elsewhere")
    (boiler.folder / name).symlink_to(elsewhere)
    with pytest.raises(PlantError, match=rf"'{name}.* is a link; put what it leads to in its place"):
        loaded(boiler)


def test_modules_of_the_folder(boiler: Copy) -> None:
    assert set(modules(read_files(boiler.folder))) == {"process"}
