"""Decoding that follows a JSON schema: at every step only bytes with which the answer can still satisfy it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import llguidance
import numpy as np
from llguidance.numpy import allocate_token_bitmask, apply_token_bitmask_inplace, fill_next_token_bitmask

from tests.llm.random_model.transformer import END, VOCABULARY, Reader, Weights

PROMPT = 512
"""Bytes of the prompt that are read, from its end: a random model understands more of them no better."""


@dataclass(frozen=True)
class Text:
    """What the model said."""

    content: str
    """Text."""
    tokens: int
    """Its length [tokens]."""
    ended: bool
    """Whether it came to an end by itself."""


class SchemaRefused(ValueError):
    """The engine cannot decode along this schema."""


class _Bytes:
    """The tokenizer: every byte is a token."""

    eos_token_id = END
    bos_token_id = None

    def __init__(self) -> None:
        self.tokens = [bytes([i]) for i in range(256)] + [b"<|end|>"]
        self.special_token_ids = [END]

    def __call__(self, text: bytes | str) -> list[int]:
        return list(text.encode() if isinstance(text, str) else text)


TOKENIZER = llguidance.LLTokenizer(llguidance.TokenizerWrapper(_Bytes()))
# A byte on its own may be half a character, and control characters must not stand in a JSON string. Where the grammar
# leaves nothing else, as in an option with an umlaut, they are taken: what is forced there is a whole character.
FEW, LEFT_OUT = 16, 4.0
"""So few bytes that may follow are the beginnings of values; by how much the logit of ``null`` grows then."""
PRINTABLE = np.zeros(VOCABULARY, dtype=np.float32)
PRINTABLE[:32] = PRINTABLE[127:256] = -np.inf


def answer(
    weights: Weights, prompt: str, schema: Mapping[str, object] | None, most: int, seed: int, temperature: float
) -> Text:
    """Up to ``most`` tokens after ``prompt``; with a schema, JSON that satisfies it, or SchemaRefused."""
    draw = np.random.default_rng(seed)
    matcher = None if schema is None else _matcher(schema)
    mask = allocate_token_bitmask(1, VOCABULARY)
    reader, said = Reader(weights), bytearray()
    logits = reader.read(list(prompt.encode()[-PROMPT:]) or [ord(" ")])
    for count in range(most):
        if reader.full:
            break
        if matcher is not None:
            fill_next_token_bitmask(matcher, mask, 0)
            apply_token_bitmask_inplace(logits[None], mask)
            _leave_out(logits)
        printable = logits + PRINTABLE
        token = _chosen(printable if np.isfinite(printable).any() else logits, draw, temperature)
        if token == END:
            return Text(_text(said), count, True)
        said.append(token)
        if matcher is not None:
            matcher.consume_token(token)
            if matcher.is_stopped():
                return Text(_text(said), count + 1, True)
        logits = reader.read([token])
    return Text(_text(said), len(said), False)


def _matcher(schema: Mapping[str, object]) -> llguidance.LLMatcher:
    # Free white space would let a random model write spaces for ever.
    grammar = llguidance.LLMatcher.grammar_from_json_schema(json.dumps(schema), {"whitespace_flexible": False})
    matcher = llguidance.LLMatcher(TOKENIZER, grammar)
    # A matcher never raises: with a schema that it does not know it stops at once, which would pass for an answer.
    if matcher.is_error():
        raise SchemaRefused(matcher.get_error())
    return matcher


def _leave_out(logits: np.ndarray) -> None:
    """Make ``null`` likelier where it begins one of a few ways to go on: most of what may be said is left out."""
    begins = np.isfinite(logits)
    if begins[ord("n")] and (begins[ord('"')] or begins[ord("1")]) and begins.sum() <= FEW:
        logits[ord("n")] += LEFT_OUT


def _text(said: bytearray) -> str:
    # The limit may fall inside a character.
    return said.decode(errors="ignore")


def _chosen(logits: np.ndarray, draw: np.random.Generator, temperature: float) -> int:
    if temperature <= 0.0:
        return int(np.argmax(logits))
    weights = np.exp((logits - logits.max()) / temperature)
    return int(draw.choice(VOCABULARY, p=weights / weights.sum()))
