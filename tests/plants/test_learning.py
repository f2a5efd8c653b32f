"""Reference values are learned from plants that are well; what is wrong with another one is said."""

from __future__ import annotations

from pathlib import Path

import pytest

from homeostat.plants.error import PlantError
from homeostat.plants.plant import load_plant
from homeostat.plants.teaching.learning import learn
from tests.plants.copies import Copy


@pytest.fixture
def reactor(tmp_path: Path) -> Copy:
    return Copy.of("cstr", tmp_path)


SICK = [
    (
        "engineering/transitions.csv",
        "L1 >= 9 and T1 <= 311",
        "L1 >= 9 and T1 <= 290",
        r"does not leave start-up in 6000 s, because 'L1 >= 9 and T1 <= 290' never holds",
    ),
    (
        "engineering/limits.csv",
        "T1 <= 313",
        "T1 <= 309.5",
        r"'T1 <= 309.5' \(LIM-T-HIGH\) does not hold for [\d.]+ s, first at [\d.]+ s; correct the limit",
    ),
    ("case.toml", "sure = 0.95", "settle_s = 5990.0", r"features are never all known after it started at 3\d\d s"),
]


@pytest.mark.parametrize(("file", "old", "new", "words"), SICK)
def test_a_plant_that_is_not_well_teaches_nothing(reactor: Copy, file: str, old: str, new: str, words: str) -> None:
    reactor.replace(file, old, new)
    plant = load_plant(str(reactor.folder), learned=False)
    with pytest.raises(PlantError, match=words) as caught:
        learn(plant, 1)
    assert "a fault-free run (seed 100000) is not well" in str(caught.value) and "\n" not in str(caught.value)


def test_how_far_it_is_is_told(reactor: Copy) -> None:
    told: list[tuple[int, int]] = []
    learn(load_plant("mixing_module", learned=False), 3, lambda done, of: told.append((done, of)))
    assert told == [(1, 3), (2, 3), (3, 3)]
