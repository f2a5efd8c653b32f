"""Panels of a figure: what they keep of a case's settings, and what cannot stand on one axis."""

from __future__ import annotations

from typing import Any

import pytest

from homeostat.domain.plant.description import PlantDescription
from homeostat.domain.plant.tag import Range
from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.plants.settings.figure_panel import read_panel
from homeostat.record.figure.panel import LinePanel, StripPanel


@pytest.fixture(scope="module")
def plant() -> PlantDescription:
    return load_plant("cstr").description


def table(**settings: Any) -> dict[str, Any]:
    return {"title": "Some", "tags": ["T1", "T1.sp"], "window": [300.0, 316.0]} | settings


def test_lines_and_strips(plant: PlantDescription) -> None:
    assert read_panel(table(), plant) == LinePanel("Some", "K", ("T1", "T1.sp"), (), (), (300.0, 316.0))
    strips = read_panel({"title": "Some", "kind": "strips", "tags": ["XV1.cmd", "V1.cmd"]}, plant)
    assert strips == StripPanel("Some", "1", ("XV1.cmd", "V1.cmd"), Range(0.0, 1.0))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"tags": ["T1", "L1"]}, r"'T1' in 'K' and 'L1' in 'L' on one axis; give each unit its own"),
        ({"tags": ["T1", "T1.spp"]}, r"names tag 'T1.spp', which the plant does not have; did you mean 'T1.sp'"),
        ({"limits": ["LIM-T-HIG"]}, r"names limit 'LIM-T-HIG'.*did you mean 'LIM-T-HIGH'"),
        ({"guards": ["t_start"]}, r"names transition 't_start'.*did you mean 't_started'"),
        ({"kind": "bars"}, r"is of the kind 'bars'; there are 'lines' and 'strips'"),
        ({"kind": "strips", "tags": ["V1.cmd", "V1.pos"]}, r"strips of 'V1.cmd' and 'V1.pos', whose ranges differ"),
    ],
)
def test_what_cannot_be_drawn_is_refused(plant: PlantDescription, settings: dict[str, Any], words: str) -> None:
    with pytest.raises(PlantError, match=words):
        read_panel(table(**settings), plant)
