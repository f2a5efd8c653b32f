"""Every detector keeps the contract, and does what its source says."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
import pytest

from homeostat.detectors.catalogue import KINDS, NEEDED, detectors
from homeostat.detectors.detector import Detector
from homeostat.detectors.error import DetectionError
from homeostat.detectors.kinds.cusum import Cusum
from homeostat.detectors.kinds.cva import past
from homeostat.detectors.kinds.ewma import Ewma, weighted_means
from homeostat.detectors.kinds.pca import Pca
from homeostat.detectors.kinds.three_sigma import ThreeSigma
from tests.contracts.detector import DetectorContract, course

LIBRARIES = [pytest.param(name, marks=[pytest.mark.slow] if name in NEEDED else []) for name in KINDS]


@pytest.mark.parametrize("name", LIBRARIES)
class TestEveryDetector(DetectorContract):
    @pytest.fixture
    def detector(self, name: str) -> Detector:
        if name in NEEDED:
            pytest.importorskip(NEEDED[name], reason="the extra 'monitor' is not installed")
        return KINDS[name](1)

    def test_it_is_called_as_the_catalogue_calls_it(self, detector: Detector, name: str) -> None:
        assert detector.name == name


def test_three_sigma_is_the_distance_from_the_mean() -> None:
    rows = np.array([[0.0, -3.0], [2.0, 1.0]])
    assert np.array_equal(ThreeSigma().learn([course(100, 2)]).statistics(rows), np.abs(rows))


def test_the_sums_are_those_of_the_textbook() -> None:
    """Montgomery's tabular CUSUM with k = 0.5: up 1.5, 2.0, 0, 0; down 0, 0, 1.5, 3.0."""
    rows = np.array([[2.0], [1.0], [-2.0], [-2.0]])
    found = Cusum().learn([course(100, 1)]).statistics(rows)
    assert found[:, 0].tolist() == [1.5, 2.0, 1.5, 3.0]


def test_weighted_means_forget() -> None:
    assert np.allclose(weighted_means(np.array([[1.0], [1.0], [0.0]]))[:, 0], [0.2, 0.36, 0.288])


def test_the_mean_of_independent_rows_wanders_as_it_is_known_to() -> None:
    """Its variance is weight / (2 - weight): 1/9 (Lucas and Saccucci, 1990)."""
    noise = np.random.default_rng(1).normal(size=(20_000, 1))
    assert Ewma().learn([noise]).statistics(np.ones((200, 1)))[-1, 0] == pytest.approx(3.0, rel=0.03)


def test_a_mean_that_wanders_more_is_given_more_room() -> None:
    slow = np.repeat(np.random.default_rng(1).normal(size=(500, 1)), 20, axis=0)
    assert Ewma().learn([slow]).statistics(np.ones((200, 1)))[-1, 0] < 1.3


def test_inside_the_plane_and_away_from_it_are_told_apart() -> None:
    drawn = np.random.default_rng(1)
    cause = drawn.normal(size=(2_000, 1))
    rows = np.concatenate([cause, cause], axis=1) + 0.01 * drawn.normal(size=(2_000, 2))
    plane = Pca().learn([rows])
    (inside,), (away,) = plane.statistics(np.array([[3.0, 3.0]])), plane.statistics(np.array([[0.5, -0.5]]))
    assert inside[0] == pytest.approx(9.0, rel=0.1) and inside[1] < 0.01
    assert away[0] < 0.1 and away[1] == pytest.approx(0.5, rel=0.05)


def test_the_past_is_newest_first() -> None:
    assert past(np.array([[1.0], [2.0], [3.0]]), 2).tolist() == [[1.0, 1.0], [2.0, 1.0], [3.0, 2.0]]


def test_an_unknown_detector_is_named_with_those_that_there_are() -> None:
    with pytest.raises(DetectionError, match=r"'pac' is no detector; there are three-sigma, .*, and all"):
        detectors(["ewma", "pac"], 1)


def test_a_detector_that_is_named_twice_judges_once() -> None:
    assert [d.name for d in detectors(["pca", "ewma", "pca"], 1)] == ["pca", "ewma"]


def test_all_of_them_are_those_that_can_be_had() -> None:
    here = [name for name in KINDS if name not in NEEDED or find_spec(NEEDED[name])]
    assert [d.name for d in detectors(["all"], 1)] == here


@pytest.mark.skipif(find_spec("sklearn") is not None, reason="the extra 'monitor' is installed")
def test_a_missing_library_is_named_with_what_installs_it() -> None:
    with pytest.raises(DetectionError, match=r"isolation-forest needs scikit-learn; .*homeostat\[monitor\]"):
        detectors(["isolation-forest"], 1)
