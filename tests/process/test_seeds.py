"""Seeds with names: streams of different names, or of different seeds, share nothing; equal ones give equal draws."""

from __future__ import annotations

import ast
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import homeostat
from homeostat.plants.files.places import plant_names
from homeostat.plants.plant import load_plant
from homeostat.process.seeds import Stream, child, generator, noise_seed
from homeostat.twin.twin import Purpose

SEEDS = st.integers(0, 2**32 - 1)
NAMES = st.lists(st.text(max_size=12), min_size=1, max_size=3)
SOURCES = Path(homeostat.__file__).parent


@given(SEEDS, NAMES, SEEDS, NAMES)
def test_only_equal_seeds_and_names_give_equal_draws(
    seed: int, names: list[str], other: int, others: list[str]
) -> None:
    equal = (seed, names) == (other, others)
    one, two = generator(seed, *names).random(4), generator(other, *others).random(4)
    assert (one == two).all() == equal
    assert (noise_seed(seed, *names) == noise_seed(other, *others)) == equal
    assert 0 <= noise_seed(seed, *names) < 2**63


def test_names_do_not_run_into_each_other() -> None:
    keys = {child(1, *names).spawn_key for names in (("a", "b"), ("ab",), ("b", "a"), ("a/b",), ("a", "b", ""))}
    assert len(keys) == 5


@pytest.mark.parametrize("seed", [0, 1, 7, 2**32 - 1])
def test_no_two_streams_are_the_same(seed: int) -> None:
    assert len({child(seed, name).spawn_key for name in Stream}) == len(Stream)
    draws = {name: generator(seed, name).standard_normal(2000) for name in Stream}
    for one, other in combinations(Stream, 2):
        # Five standard errors of a correlation of independent draws.
        assert abs(np.corrcoef(draws[one], draws[other])[0, 1]) < 5.0 / np.sqrt(2000), (one, other)


@pytest.mark.parametrize("name", plant_names())
@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_no_stream_of_the_twin_draws_what_the_truth_drew(name: str, seed: int) -> None:
    plant = load_plant(name)
    sd = np.array([{p.symbol: p.sd for p in plant.description.parameters}[s] for s in plant.model.parameters])
    mean = np.array([{p.symbol: p.value for p in plant.description.parameters}[s] for s in plant.model.parameters])
    uncertain = sd > 0
    true = (plant.true_parameters(seed)[uncertain] - mean[uncertain]) / sd[uncertain]
    for purpose in Purpose:
        drawn = generator(seed, purpose).standard_normal(50 * true.size)
        assert np.abs(drawn[:, None] - true).min() > 1e-9


def test_the_draws_of_a_name_do_not_change() -> None:
    """Figures of a seed hold as long as these numbers do; where they change, so must the naming's version."""
    assert noise_seed(1, Stream.TRUTH_NOISE) == 8303887644021303769
    assert generator(1, Stream.TRUTH_PARAMETERS).integers(2**32) == 2692404967


def test_what_is_drawn_has_a_name() -> None:
    with pytest.raises(ValueError, match="say what is drawn"):
        child(1)


def test_no_generator_is_made_but_from_a_child() -> None:
    made = []
    for path in sorted(SOURCES.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
            if called.endswith(("default_rng", "RandomState", "SeedSequence", "Random", "random.seed")):
                made.append((path.relative_to(SOURCES).as_posix(), called))
    assert made == [("process/seeds.py", "np.random.SeedSequence"), ("process/seeds.py", "np.random.default_rng")]
