"""Lines of the shipped plants are those that somebody wrote."""

from __future__ import annotations

from benchmarks.plants.lines import PLANTS, ROOT, SHIPPED, Lines, counted


def test_only_what_is_written_is_counted_by_its_kind() -> None:
    files = {"a/process.py": "x\ny\n", "a/true/plant.py": "z", "a/case.toml": "t = 1\n", "a/states.csv": "id\n1\n",
             "a/plant.ttl": "1\n2\n3\n", "a/baseline.csv": "1\n2\n", "a/plant.sig": "s"}  # fmt: skip
    assert counted(files, files.__getitem__) == {"tables": 2, "settings": 1, "code": 3}
    assert Lines({"code": 10}, {"code": 4}).share == 0.4


def test_the_reactor_has_no_kernel_of_its_own_any_more() -> None:
    code = {path.name for path in (ROOT / PLANTS / SHIPPED[0]).rglob("*.py")}
    assert code == {"__init__.py", "process.py", "plant.py"}
