"""What recovery would do about each fault: an answer with its cost and what binds, or why there is none."""

from __future__ import annotations

import pytest

from homeostat.evaluate.lint.deep.answers import Answered, answers
from homeostat.evaluate.lint.deep.bench import Bench
from homeostat.evaluate.lint.finding import Finding
from homeostat.plants.files.folder import INSTALLED


@pytest.mark.wide
@pytest.mark.slow
def test_every_fault_of_the_reactor_has_an_answer_or_a_reason() -> None:
    bench = Bench(INSTALLED / "cstr")
    found = list(answers(bench))
    given = {each.fault: each for each in found if isinstance(each, Answered)}
    assert given.keys() == {fault.name for fault in bench.plant.description.faults}
    rules = {c.name for c in bench.plant.description.limits.criteria}
    rules |= {limit.name for limit in bench.plant.description.limits.limits}
    for each in given.values():
        if each.path:
            assert each.binds in rules and each.margin is not None and each.cost_share is not None and not each.reason
        else:
            assert each.reason and each.cost_share is None
    assert not any(each.counts for each in found if isinstance(each, Finding))
    assert given["pump_degrade"].path[0] == "normal" and given["fouling"].path == ()
