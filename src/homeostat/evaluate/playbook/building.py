"""A playbook built offline: every question that it has no entry for yet, here, on several processes or on a cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from homeostat import __version__
from homeostat.domain.playbook import Entry
from homeostat.evaluate.playbook.answering import answered
from homeostat.evaluate.playbook.points import Question
from homeostat.evaluate.study.plan.job import code_digest
from homeostat.evaluate.study.plan.plants import own_plant
from homeostat.plants.plant import Plant, load_plant
from homeostat.process.batch import use_threads
from homeostat.record.playbook import PlaybookError, add_to_playbook, read_playbook


@dataclass(frozen=True, slots=True)
class Answered:
    """One question that was worked on."""

    question: Question
    """Which one."""
    entry: Entry | None
    """Its entry, which says also that there is no answer; None where working on it failed."""
    failure: str = ""
    """What failed, in one line; empty where nothing did."""


@dataclass(frozen=True, slots=True)
class Workplace:
    """What a process needs to answer questions about the same plant."""

    case: str
    """Name of the plant, or absolute path of its folder."""
    configuration: str
    """Digest of its configuration."""
    package: str
    """Digest of the package that asks."""

    @classmethod
    def of(cls, plant: Plant) -> Workplace:
        """Where ``plant`` can be had."""
        own = own_plant(plant)
        return cls(plant.name if own is None else own.folder, plant.configuration, code_digest())


@dataclass(frozen=True, slots=True)
class Hands:
    """Who works."""

    jobs: int = 1
    """Processes of this machine; 1 for this one alone."""
    cluster: str | None = None
    """Address of a Dask scheduler; None for this machine."""


def left_of(plant: Plant, asked: Sequence[Question], path: Path) -> list[Question]:
    """Those of ``asked`` that the playbook at ``path`` has no entry for, of this configuration and version."""
    present = plant.configuration, __version__
    there = {e.source for e in read_playbook(path).entries if (e.configuration, e.version) == present}
    return [question for question in asked if question.source not in there]


def build(
    plant: Plant, asked: Sequence[Question], path: Path, hands: Hands, show: Callable[[Answered], None]
) -> tuple[Answered, ...]:
    """Answer what is ``asked``, add each entry to the playbook at ``path`` as it is known, and ``show`` it.

    The same call goes on where this one stopped. Raises PlaybookError where the file is full or in use, StudyError
    where workers cannot be had, OSError where the disk takes no more.
    """
    done = []
    for one in _answers(plant, asked, hands):
        if one.entry is not None:
            add_to_playbook(path, [one.entry])
        done.append(one)
        show(one)
    return tuple(done)


def _answers(plant: Plant, asked: Sequence[Question], hands: Hands) -> Iterator[Answered]:
    if not asked:
        return
    if hands.jobs == 1 and hands.cluster is None:
        yield from (_tried(plant, question) for question in asked)
        return
    try:
        from homeostat.evaluate.study.cluster import at_address, on_this_machine, results
    except ImportError as error:
        raise PlaybookError(
            f"several processes need {error.name!r}: pip install 'homeostat[campaign]', or use --jobs 1"
        ) from error
    place, by_key = Workplace.of(plant), {question.source: question for question in asked}
    with ExitStack() as stack:
        workers = min(hands.jobs, len(asked))
        client = on_this_machine(stack, workers) if hands.cluster is None else at_address(stack, hands.cluster)
        for key, found in results(client, elsewhere, {key: (place, q) for key, q in by_key.items()}):
            yield Answered(by_key[key], None, _line(found)) if isinstance(found, BaseException) else found


def elsewhere(place: Workplace, question: Question) -> Answered:
    """``question`` answered by a worker that may be another machine."""
    if code_digest() != place.package:
        return Answered(
            question, None, "the worker has another version of the package; install the same one everywhere"
        )
    plant = _loaded(place.case)
    if plant.configuration != place.configuration:
        return Answered(question, None, f"the worker has another {plant.name}; give every machine the same folder")
    return _tried(plant, question)


@lru_cache(maxsize=2)
def _loaded(case: str) -> Plant:
    return load_plant(case)


def _tried(plant: Plant, question: Question) -> Answered:
    """On one core; a bug in one question is its failure and not that of the others."""
    use_threads(1)
    try:
        return Answered(question, answered(plant, question))
    except Exception as error:
        return Answered(question, None, _line(error))
    finally:
        use_threads(0)


def _line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
