"""A controller that resumes wrongly from the second part of a split range is found where the course goes there."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from homeostat.evaluate.lint.deep import following
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.process.blocks.present import resuming
from homeostat.process.blocks.present.outputs import told_by

AIR = Path(__file__).parents[3] / "examples" / "instrument_air"


@pytest.fixture(scope="module")
def vented(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    """The example with a header that begins above its setpoint, so that the vent opens first."""
    ignored = shutil.ignore_patterns("plant.ttl", "__pycache__")
    made = Path(shutil.copytree(AIR, tmp_path_factory.mktemp("split") / "air", ignore=ignored))
    table = made / "engineering" / "parameters.csv"
    text = table.read_text("utf-8")
    assert "start_B2,150," in text
    table.write_text(text.replace("start_B2,150,", "start_B2,290,"), "utf-8")
    return Bench(made)


def test_what_resumes_rightly_is_not_told(vented: Bench) -> None:
    vents = following.recorded(vented)[0].readings["V3_cmd"]
    assert ((vents > 0.1) & (vents < 0.9)).any()
    assert not list(following._resumed_further(vented))


def test_a_controller_that_knows_its_first_part_alone_is_found(vented: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(resuming, "told_by", lambda parts, *rest: told_by(parts[:1], *rest))
    for moment in following.moments(vented):  # where the other part rests nothing shows
        assert not list(following._resumed(vented, moment))
    found = [finding.what for finding in following._resumed_further(vented)]
    assert len(found) == 1 and "control commands 'V3.cmd'" in found[0]
