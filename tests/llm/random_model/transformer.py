"""A transformer decoder with random weights over bytes: it has an opinion about everything and knows nothing.

Per layer, with h the hidden state of one token, shape (WIDTH,):

    q, k, v = W_q n(h), W_k n(h), W_v n(h)           n: h / rms(h)
    h <- h + W_o sum_t softmax_t(q . k_t / sqrt(d)) v_t   over every token so far, per head of size d
    h <- h + W_2 gelu(W_1 n(h))

Logits are s W n(h) with a sharpness s; W is not the embedding, or the model would repeat what it said last. Positions
are rotary (Su et al., 2021): pairs of q and k are turned by position * 10000^(-2i/d). Keys and values are kept, so one
token costs one pass.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

VOCABULARY = 257
"""256 bytes and the end of the text."""
END = 256
"""Token that ends a text."""
WIDTH, HEADS, LAYERS, HIDDEN = 64, 4, 2, 128
SIZE = WIDTH // HEADS
SHARPNESS = 1.5
"""A sharper model of random weights says the same for ever."""
CONTEXT = 4096
"""Most tokens of prompt and answer; of a longer prompt the end is read."""

Array = NDArray[np.float32]


class Weights:
    """Random weights; the same seed gives the same model."""

    def __init__(self, seed: int) -> None:
        draw = np.random.default_rng(seed)

        def matrix(rows: int, columns: int) -> Array:
            drawn: Array = (draw.standard_normal((rows, columns)) / np.sqrt(columns)).astype(np.float32)
            return drawn

        self.embedding = draw.standard_normal((VOCABULARY, WIDTH)).astype(np.float32)
        self.head = matrix(VOCABULARY, WIDTH)
        self.layers = [
            (matrix(3 * WIDTH, WIDTH), matrix(WIDTH, WIDTH), matrix(HIDDEN, WIDTH), matrix(WIDTH, HIDDEN))
            for _ in range(LAYERS)
        ]
        angles = np.outer(np.arange(CONTEXT), 10000.0 ** (-np.arange(0, SIZE, 2) / SIZE))
        self.cos, self.sin = np.cos(angles).astype(np.float32), np.sin(angles).astype(np.float32)


class Reader:
    """One text being read: keys and values of what was read so far."""

    def __init__(self, weights: Weights) -> None:
        self._weights = weights
        self._keys = [np.empty((HEADS, CONTEXT, SIZE), np.float32) for _ in range(LAYERS)]
        self._values = [np.empty((HEADS, CONTEXT, SIZE), np.float32) for _ in range(LAYERS)]
        self._length = 0

    @property
    def full(self) -> bool:
        """Whether no further token fits."""
        return self._length >= CONTEXT

    def read(self, tokens: list[int]) -> Array:
        """Logits of the token after ``tokens``, shape (VOCABULARY,)."""
        count, start = len(tokens), self._length
        hidden = self._weights.embedding[tokens]
        for layer, (qkv, out, up, down) in enumerate(self._weights.layers):
            query, key, value = np.split(_normal(hidden) @ qkv.T, 3, axis=-1)
            query, key = self._turned(query, start), self._turned(key, start)
            self._keys[layer][:, start : start + count] = key
            self._values[layer][:, start : start + count] = _heads(value)
            hidden = hidden + self._attend(layer, query, start, count) @ out.T
            hidden = hidden + _gelu(_normal(hidden) @ up.T) @ down.T
        self._length += count
        logits: Array = _normal(hidden[-1]) @ self._weights.head.T * SHARPNESS
        return logits

    def _attend(self, layer: int, query: Array, start: int, count: int) -> Array:
        """What each of the last ``count`` tokens takes from those up to itself, shape (count, WIDTH)."""
        end = start + count
        scores = query @ self._keys[layer][:, :end].transpose(0, 2, 1) / np.sqrt(np.float32(SIZE))
        if count > 1:
            later = np.arange(end)[None, :] > np.arange(start, end)[:, None]
            scores = np.where(later[None], np.float32(-1e9), scores)
        scores = np.exp(scores - scores.max(axis=-1, keepdims=True))
        mixed = (scores / scores.sum(axis=-1, keepdims=True)) @ self._values[layer][:, :end]
        joined: Array = mixed.transpose(1, 0, 2).reshape(count, WIDTH)
        return joined

    def _turned(self, rows: Array, start: int) -> Array:
        """Rotary positions, shape (HEADS, count, SIZE)."""
        heads = _heads(rows)
        cos, sin = (t[start : start + len(rows)] for t in (self._weights.cos, self._weights.sin))
        even, odd = heads[..., 0::2], heads[..., 1::2]
        turned = np.empty_like(heads)
        turned[..., 0::2], turned[..., 1::2] = even * cos - odd * sin, even * sin + odd * cos
        return turned


def _heads(rows: Array) -> Array:
    """(count, WIDTH) as (HEADS, count, SIZE)."""
    split: Array = rows.reshape(len(rows), HEADS, SIZE).transpose(1, 0, 2)
    return split


def _normal(rows: Array) -> Array:
    scaled: Array = rows / np.sqrt(np.mean(rows * rows, axis=-1, keepdims=True) + np.float32(1e-6))
    return scaled


def _gelu(rows: Array) -> Array:
    gate = 1.0 + np.tanh(0.7978845608 * (rows + 0.044715 * rows**3))
    curved: Array = (0.5 * rows * gate).astype(np.float32, copy=False)
    return curved
