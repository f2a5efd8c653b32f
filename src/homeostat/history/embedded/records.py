"""Records of the log: what was appended, each with its length and a checksum, so that what was cut off is known.

A record is a mark, its kind, its length, a CRC-32 over these and what follows, and that: names of tags (JSON), samples
(columns, compressed) or an occurrence (JSON). Tags are numbered within a segment, in the order of their names there.
"""

import json
import struct
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import Final

import numpy as np
import pyarrow as pa

from homeostat.history.samples import Batch, Codes, Times, Values
from homeostat.history.store import Occurrence

HEADER: Final = b"HSLOG\x01\r\n"
"""Begins every segment."""
_MARK: Final = b"\xf5HSR"
_HEAD: Final = struct.Struct("<4sBII")
_SAMPLES: Final = struct.Struct("<qIII")
_CODEC: Final = pa.Codec("zstd", 1)


class Kind(IntEnum):
    """What a record holds."""

    TAGS = 1
    SAMPLES = 2
    OCCURRENCE = 3


@dataclass(frozen=True, slots=True)
class Record:
    """A record that is whole."""

    kind: int
    """What it holds."""
    content: bytes
    """That."""


@dataclass(frozen=True, slots=True)
class Gap:
    """Bytes of a segment that are no record."""

    at: int
    """Where they begin [byte]."""
    length: int
    """How many [byte]."""
    torn: bool
    """Whether nothing whole follows: the write that was under way when the process or the power ended."""


@dataclass(frozen=True, slots=True)
class Kept:
    """A batch as its record has it; n samples with m different server times."""

    tag: Times
    """Number of each sample's tag in its segment, shape (n,)."""
    time_us: Times
    """Source time [us], shape (n,)."""
    value: Values
    """Value, shape (n,)."""
    quality: Codes
    """Status code, shape (n,)."""
    arrival: Times
    """Which of the server times is each sample's, shape (n,)."""
    server_us: Times
    """Different server times [us], shape (m,)."""
    own_us: int
    """When the batch arrived [us]."""


def framed(kind: Kind, content: bytes) -> bytes:
    """``content`` as a record."""
    head = _HEAD.pack(_MARK, kind, len(content), 0)
    return _HEAD.pack(_MARK, kind, len(content), zlib.crc32(content, zlib.crc32(head))) + content


def scan(raw: bytes) -> Iterator[Record | Gap]:
    """Every whole record of a segment, and what lies between or behind them, in order."""
    at = len(HEADER) if raw.startswith(HEADER) else 0
    while at < len(raw):
        record = _record_at(raw, at)
        if record is None:
            following = _next(raw, at + 1)
            yield Gap(at, (following or len(raw)) - at, following is None)
            at = following or len(raw)
        else:
            yield record
            at += _HEAD.size + len(record.content)


def _record_at(raw: bytes, at: int) -> Record | None:
    if raw[at : at + len(_MARK)] != _MARK or at + _HEAD.size > len(raw):
        return None
    _, kind, length, checksum = _HEAD.unpack_from(raw, at)
    content = raw[at + _HEAD.size : at + _HEAD.size + length]
    head = _HEAD.pack(_MARK, kind, length, 0)
    if len(content) != length or zlib.crc32(content, zlib.crc32(head)) != checksum:
        return None
    return Record(kind, content)


def _next(raw: bytes, at: int) -> int | None:
    """Where the next whole record begins."""
    while (at := raw.find(_MARK, at)) >= 0:
        if _record_at(raw, at) is not None:
            return at
        at += 1
    return None


def names_record(names: Mapping[str, int]) -> bytes:
    """Tag -> its number in the segment."""
    return framed(Kind.TAGS, json.dumps(names).encode())


def names_of(record: Record) -> Mapping[str, int]:
    """What :func:`names_record` was given."""
    found: Mapping[str, int] = json.loads(record.content)
    return found


def samples_record(batch: Batch, numbers: Sequence[int]) -> bytes:
    """``batch``, whose tags have ``numbers``: times as differences, each column for itself, compressed."""
    server, arrival = np.unique(batch.server_us, return_inverse=True)
    tag = np.asarray(numbers, dtype=np.uint32)
    columns = (
        np.diff(tag, prepend=np.uint32(0)),
        batch.time_us - np.int64(batch.own_us),
        batch.value,
        batch.quality,
        arrival.astype(np.uint32),
        server,
    )
    plain = b"".join(column.tobytes() for column in columns)
    head = _SAMPLES.pack(batch.own_us, len(tag), len(server), len(plain))
    return framed(Kind.SAMPLES, head + _CODEC.compress(plain, asbytes=True))


def samples_of(record: Record) -> Kept:
    """What :func:`samples_record` was given."""
    own_us, n, m, size = _SAMPLES.unpack_from(record.content)
    plain = _CODEC.decompress(record.content[_SAMPLES.size :], decompressed_size=size, asbytes=True)
    at, found = 0, []
    for kind, length in (("u4", n), ("i8", n), ("f8", n), ("u4", n), ("u4", n), ("i8", m)):
        found.append(np.frombuffer(plain, kind, length, at))
        at += found[-1].nbytes
    tag, time_us, value, quality, arrival, server = found
    number = np.cumsum(tag, dtype=np.uint32).astype(np.int64)
    return Kept(number, time_us + np.int64(own_us), value, quality, arrival.astype(np.int64), server, own_us)


def occurrence_record(occurrence: Occurrence) -> bytes:
    """An alarm or an event."""
    return framed(Kind.OCCURRENCE, json.dumps(asdict(occurrence)).encode())


def occurrence_of(record: Record) -> Occurrence:
    """What :func:`occurrence_record` was given."""
    return Occurrence(**json.loads(record.content))
