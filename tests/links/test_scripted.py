"""The scripted plant: the contract, lags, pushes and what is refused."""

from __future__ import annotations

import math

import pytest

from homeostat.domain.recovery import Command
from homeostat.links.simulated import SimulatedLink
from tests.contracts.link import Handles, LinkContract, Open, read
from tests.equipment.links.scripted import PlantScript, Push, ScriptedPlant, ScriptedTag
from tests.links.tank import script, tank


class TestScriptedPlant(LinkContract):
    @pytest.fixture
    def opened(self) -> Open:
        return lambda: SimulatedLink(ScriptedPlant(script(noise=0.5)))

    @pytest.fixture
    def handles(self) -> Handles:
        return Handles("L.sp", -2.0, 0.5, "cool.man", "L")


def test_a_reading_follows_what_is_commanded_with_its_lag() -> None:
    link = tank()
    link.take().send((Command("L.sp", 12.0, None), Command("cool.man", 0.5, None)))
    found = read(link, 60)
    assert found[4].values["L"] == pytest.approx(10.0 + 2.0 * (1.0 - math.exp(-1.0)))
    assert found[-1].values["L"] == pytest.approx(12.0, abs=1e-3)
    assert found[-1].values["T"] == pytest.approx(290.0, abs=1e-3), "from zero, as it was on automatic"


def test_a_manual_output_counts_nothing_on_automatic() -> None:
    link = tank()
    wire = link.take()
    wire.send((Command("cool.man", 0.5, None),))
    read(link, 60)
    wire.send((Command("cool.man", None, None),))
    assert read(link, 60)[-1].values["T"] == pytest.approx(300.0, abs=1e-3)


def test_a_push_moves_a_reading_for_its_time() -> None:
    link = SimulatedLink(ScriptedPlant(script(pushes=(Push("T", 20.0, 100.0, 200.0), Push("T", 5.0, 150.0, 200.0)))))
    found = read(link, 300)
    assert all(s.values["T"] == 300.0 for s in found[:99])
    assert found[99].values["T"] > 300.0
    assert [found[k].values["T"] for k in (148, 198, 299)] == pytest.approx([320.0, 325.0, 300.0], abs=0.01)


def test_the_noise_is_its_seeds_and_not_in_the_truth() -> None:
    plants = [ScriptedPlant(script(noise=1.0, seed=seed)) for seed in (1, 1, 2)]
    one, again, other = ([s.values["L"] for s in read(SimulatedLink(p), 400)] for p in plants)
    assert one == again != other
    assert sum((v - 10.0) ** 2 for v in one) / 400 == pytest.approx(1.0, rel=0.25)
    assert plants[0].true == {"L": 10.0, "T": 300.0}


def test_further_tags_may_have_an_automatic_mode() -> None:
    plant = ScriptedPlant(PlantScript((), {"V.man": 0.3}, 10.0, manual=frozenset({"V.man"})))
    plant.command((Command("V.man", None, None),))
    assert plant.accepted == {"V.man": None}


@pytest.mark.parametrize(
    ("tags", "pushes", "message"),
    [
        ((ScriptedTag("L", 1.0, lag_s=0.0),), (), "lag_s 0.0 must be > 0 s"),
        ((ScriptedTag("L", 1.0, {"X": 1.0}),), (), "'X' is against that"),
        ((ScriptedTag("V.sp", 1.0),), (), "'V.sp' is against that"),
        ((ScriptedTag("L", 1.0),), (Push("T", 1.0, 0.0),), "pushes no reading"),
    ],
)
def test_a_script_that_makes_no_sense_is_refused(
    tags: tuple[ScriptedTag, ...], pushes: tuple[Push, ...], message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        PlantScript(tags, {"V.sp": 1.0}, 10.0, pushes)


def test_a_push_without_a_time_is_refused() -> None:
    with pytest.raises(ValueError, match="must be times"):
        ScriptedPlant(script(pushes=(Push("T", 1.0, math.nan),)))
