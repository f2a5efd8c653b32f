"""A model whose every call goes to the trace, and to a file where one is wanted; keys are struck out."""

import asyncio
import contextlib
import json
import logging
import math
import sys
import time
from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Final, TypeGuard

from homeostat.domain.quotation import quoted
from homeostat.journal import Setting, Trace
from homeostat.journal.beside.archive import Archive
from homeostat.journal.calls import ModelCalled
from homeostat.llm.calls import Call, append_call
from homeostat.llm.model import STRUCK_OUT, Failure, LanguageModel, ModelError, Question, Reply, Usage
from homeostat.llm.secrets import Secrets

_LONGEST: Final = 18
"""Characters that quoting may make of one."""
MOST_NAME, MOST_DETAIL = 80, 240
"""Longest name of a model that answered, and longest reason of a failure [characters]."""
_USAGE: Final = tuple(field.name for field in fields(Usage))
GRACE_S = 0.05
"""Time for a model that keeps the time itself to say how it used it [s]."""
_LOGGER = logging.getLogger(__name__)


class RecordedModel:
    """Implements :class:`homeostat.llm.model.LanguageModel`: asks another one and writes down what came of it."""

    def __init__(
        self,
        model: LanguageModel,
        trace: Trace,
        archive: Archive,
        secrets: tuple[str, ...] = (),
        file: Path | None = None,
    ) -> None:
        """``secrets`` never get further than here, even where a server repeats them; ``file`` takes calls as lines.

        Where ``file`` cannot be written it gets no further call, and a warning is logged once; asking goes on.
        """
        self._model = model
        self.name = model.name
        """The other model's."""
        self._trace = trace
        self._archive = archive
        self._secrets = Secrets(secrets)
        self._file = file

    @property
    def settings(self) -> Mapping[str, float | int | str | None]:
        """The other model's."""
        return self._model.settings

    async def ask(self, question: Question, within_s: float) -> Reply:
        """The other model's answer or failure; recorded either way, also where the asking is cancelled."""
        strike, begin = self._secrets.strike, time.monotonic()
        question = replace(question, system=strike(question.system), prompt=strike(question.prompt))
        try:
            async with asyncio.timeout(within_s + GRACE_S):
                reply = _checked(await self._model.ask(question, within_s))
        except TimeoutError:
            late = ModelError(Failure.TIMEOUT, f"within {within_s:.1f} s")
            self._record(question, None, late, begin)
            raise late from None
        except ModelError as error:
            requests = error.requests if _is_count(error.requests) else 1
            struck = ModelError(error.failure, self._line(str(error.detail)), error.retry_after_s, requests)
            self._record(question, None, struck, begin)
            raise struck from None
        except (Exception, SystemExit, asyncio.CancelledError) as error:
            if isinstance(error, asyncio.CancelledError) and _is_cancelled():
                self._record(question, None, ModelError(Failure.TIMEOUT, "the time for thinking was used up"), begin)
                raise
            # A model is outside the system: a bug in it is no answer, and nothing more.
            failed = ModelError(Failure.MALFORMED, self._line(f"{type(error).__name__}: {error}"))
            self._record(question, None, failed, begin)
            raise failed from None
        reply = replace(reply, answer=strike(reply.answer), served=self._line(reply.served, MOST_NAME))
        self._record(question, reply, None, begin)
        return reply

    def _record(self, question: Question, reply: Reply | None, error: ModelError | None, begin: float) -> None:
        latency_s = time.monotonic() - begin
        prompt = self._archive.store_prompt(f"{question.system}\n\n---\n\n{question.prompt}\n")
        schema = self._archive.store_json(json.dumps(question.schema, indent=1))
        said = reply or Reply("", "", Usage(0, 0, None), error.requests if error else 0)
        event = ModelCalled(
            agent=question.agent,
            model=self.name,
            served=said.served,
            settings=self._settings(),
            template_sha256=question.template_sha256,
            prompt_sha256=prompt.sha256,
            schema_sha256=schema.sha256,
            answer_sha256=self._archive.store_json(_storable(said.answer)).sha256 if reply else "",
            failure=error.failure.name if error else "",
            detail=str(error) if error else "",
            **asdict(said.usage),
            wall_requests=said.requests,
            wall_latency_s=latency_s,
        )
        with contextlib.suppress(OSError):  # a full disk is the guard's alarm, and no failure of the model
            self._trace.record(event, question.at_s)
        self._append(_call(question, reply, error, event))

    def _append(self, call: Call) -> None:
        """Add ``call`` to the file. A full disk must not end a recovery, and what follows a torn line is no line."""
        if self._file is None:
            return
        try:
            append_call(self._file, call)
        except OSError as error:
            path, reason = str(self._file), error.strerror or error
            _LOGGER.warning("%r cannot be written: %s; the recording of calls is incomplete", path, reason)
            self._file = None

    def _line(self, text: str, limit: int = MOST_DETAIL) -> str:
        """``text`` in one printable line, for an operator's terminal.

        Keys go before the line is cut, as half a key is not recognised, and once more after it was quoted, as quoting
        may put one together.
        """
        whole = _LONGEST * len(text) + len(STRUCK_OUT)
        return quoted(self._secrets.strike(quoted(self._secrets.strike(text), whole)), limit)

    def _settings(self) -> tuple[Setting, ...]:
        """The other model's settings as a trace can hold them; none where they cannot be read at all."""
        try:
            return tuple(
                Setting(self._line(str(name), MOST_NAME), value if _is_number(value) else self._line(str(value)))
                for name, value in self._model.settings.items()
                if value is not None
            )
        except Exception as error:  # they only describe a model; a bug there must not end the asking
            _LOGGER.warning("the settings of a model cannot be read: %s", type(error).__name__)
            return ()


def _checked(reply: Reply) -> Reply:
    """``reply`` where it is one; TypeError or ValueError where a model that is not ours gave something else."""
    if not (isinstance(reply, Reply) and isinstance(reply.answer, str) and isinstance(reply.served, str)):
        raise TypeError(f"the model answered with {type(reply).__name__}, which is no reply with a text")
    usage = reply.usage
    if not all(_is_count(n) for n in (usage.input_tokens, usage.output_tokens, reply.requests)):
        raise ValueError("the model counted tokens or requests that no whole number of at least 0 stands for")
    if usage.cost_usd is not None and not (_is_number(usage.cost_usd) and usage.cost_usd >= 0.0):
        raise ValueError("the model has a cost that is no number of at least 0")
    return reply


def _is_cancelled() -> bool:
    """Whether somebody has cancelled the asking, and the model does not only say so."""
    task = asyncio.current_task()
    return task is not None and task.cancelling() > 0


def _is_count(value: object) -> bool:
    return type(value) is int and 0 <= value <= sys.maxsize  # longer ones cannot be written


def _is_number(value: object) -> TypeGuard[int | float]:
    """Whether ``value`` is a number that a trace and a line of JSON can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) <= sys.maxsize and math.isfinite(value)


def _call(question: Question, reply: Reply | None, error: ModelError | None, event: ModelCalled) -> Call:
    same = {name: getattr(event, name) for name in ("model", "served", "detail", *_USAGE)}
    asked = {name: getattr(question, name) for name in ("agent", "at_s", "system", "prompt", "schema")}
    answer, failure = reply.answer if reply else None, error.failure if error else None
    return Call(answer=answer, failure=failure, latency_s=event.wall_latency_s, **same, **asked)


def _storable(text: str) -> str:
    """``text`` as it can be written in UTF-8: half a surrogate pair cannot."""
    return text.encode("utf-8", "backslashreplace").decode("utf-8")
