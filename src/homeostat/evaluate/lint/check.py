"""The whole check of a plant's folder: what is stated, then what its code makes of it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from homeostat.evaluate.lint.checks import LOADING
from homeostat.evaluate.lint.child import Begun, carried_out
from homeostat.evaluate.lint.deep.answers import Answered
from homeostat.evaluate.lint.deep.faults import Outlook
from homeostat.evaluate.lint.finding import Finding
from homeostat.evaluate.lint.stated import stated
from homeostat.plants.files.folder import SETTINGS, PlantFiles, read_files
from homeostat.plants.files.places import plant_folder
from homeostat.plants.settings.lines import line_of


@dataclass(frozen=True, slots=True)
class Checked:
    """What came of a check."""

    findings: tuple[Finding, ...]
    """Everything that was found, notes included, in the order in which it was."""
    outlooks: tuple[Outlook, ...] = ()
    """What comes of each fault; empty where no simulation came so far."""
    answers: tuple[Answered, ...] = ()
    """What recovery would do about each fault; empty where that was not asked for."""

    @property
    def clean(self) -> bool:
        """Whether nothing was found that counts."""
        return not any(finding.counts for finding in self.findings)


def check(
    name: str,
    names: Sequence[str] = LOADING,
    told: Callable[[Begun], None] = lambda begun: None,
    said: Callable[[Finding], None] = lambda finding: None,
) -> Checked:
    """Check the plant called ``name``, or the folder that it is a path of, by its files and the checks of ``names``.

    ``told`` hears which check has begun, and ``said`` each finding as it is found, in their order. The plant's
    code runs in another process, and nothing is written.
    Raises PlantError where there is no such plant, or its folder holds what no plant's may.
    """
    files = read_files(plant_folder(name))
    told(Begun("tables"))
    first = stated(files)
    lines = settings_lines(files)
    findings, outlooks, answers = list[Finding](), list[Outlook](), list[Answered]()
    beyond = carried_out(files.folder, tuple(names), told) if first.sound else ()
    for each in chain(first.findings, beyond):
        match each:
            case Finding():
                findings.append(lines(each))
                said(findings[-1])
            case Outlook():
                outlooks.append(each)
            case _:
                answers.append(each)
    return Checked(tuple(findings), tuple(outlooks), tuple(answers))


def settings_lines(files: PlantFiles) -> Callable[[Finding], Finding]:
    """What gives a finding about a key of the settings the line that states it."""
    text = files.content(SETTINGS).decode("utf-8", "replace")

    def located(finding: Finding) -> Finding:
        where = finding.where
        if where.file != SETTINGS or where.row is not None or not where.key:
            return finding
        return replace(finding, where=replace(where, row=line_of(text, where.key.split(", "))))

    return located
