"""``baseline.csv``: the reference values of a plant's features, with what they were learned from and a seal."""

import csv
import hashlib
import io
import json
import math
import re
from collections.abc import Mapping
from dataclasses import astuple, fields
from typing import Annotated, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from homeostat.domain.diagnosis import Feature
from homeostat.domain.plant.baseline import Baseline
from homeostat.domain.plant.description import PlantDescription
from homeostat.knowledge.build.provenance import is_sealed, seal
from homeostat.knowledge.checks.intervals import Interval, span
from homeostat.knowledge.store.error import Code, GraphError
from homeostat.plants.files.folder import BASELINES
from homeostat.stl.spelling import near_matches
from homeostat.stl.units import in_unit

_LEARNED_FROM: Final = re.compile(r"# learned from ([0-9a-f]{64})")
_COLUMNS: Final = tuple(field.name for field in fields(Baseline))
_PERCENTILES: Final = {"p01": 0.01, "p05": 0.05, "p50": 0.50, "p95": 0.95, "p99": 0.99}
_SLACK: Final = 0.1
"""By how much of its width a feature may leave the interval that its tags' ranges allow: noise at the ends [1]."""

Number = Annotated[float, Field(allow_inf_nan=False)]
Deviation = Annotated[float, Field(allow_inf_nan=False, ge=0.0)]


class _Row(BaseModel):
    """One line of the file: finite numbers, deviations that are not negative."""

    model_config = ConfigDict(extra="forbid")

    feature: str
    mean: Number
    within_sd: Deviation
    between_sd: Deviation
    p01: Number
    p05: Number
    p50: Number
    p95: Number
    p99: Number


def write_baselines(baselines: tuple[Baseline, ...], learned_from: str) -> bytes:
    """The file: one row per feature, what they were learned from, the seal."""
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(_COLUMNS)
    for baseline in baselines:
        name, *numbers = astuple(baseline)
        table.writerow([name, *(f"{number:.6g}" for number in numbers)])
    return seal(f"{text.getvalue()}# learned from {learned_from}\n".encode())


def refuse_altered(content: bytes) -> None:
    """GraphError where the file is not as it was written."""
    if not is_sealed(content):
        remedy = "restore it, or remove it and run 'homeostat plant learn CASE'"
        message = f"does not match its own hash: it was changed after it was learned; {remedy}"
        raise GraphError(Code.ALTERED, BASELINES, message)


def learned_from(content: bytes) -> str:
    """Digest of what the values were learned from, as the file says; empty where it does not say."""
    found = _LEARNED_FROM.search(content.decode("utf-8", "replace"))
    return "" if found is None else found[1]


def read_baselines(content: bytes, plant: PlantDescription) -> dict[str, Baseline]:
    """Feature -> reference values.

    Raises GraphError where a feature of ``plant`` is missing, unknown or there twice, or has values that no feature
    with its expression can have.
    """
    lines = [line for line in content.decode("utf-8", "replace").splitlines() if not line.startswith("#")]
    known = {feature.name: feature for feature in plant.features}
    found: dict[str, Baseline] = {}
    for row in csv.DictReader(lines, restkey="more cells"):
        name = str(row.get("feature"))
        if name not in known:
            raise _bad(name, f"the plant has no such feature{near_matches(name, known)}")
        if name in found:
            raise _bad(name, "has two rows")
        try:
            found[name] = Baseline(**_Row.model_validate(row).model_dump())
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            raise _bad(name, f"{first['loc'][0]}: {first['msg']} (given: {first['input']!r:.60})") from None
        _refuse_absurd(found[name], known[name], _interval(known[name], plant))
    for name in known:
        if name not in found:
            raise _bad(name, "has no row; learn the reference values again")
    return found


def _bad(feature: str, message: str) -> GraphError:
    return GraphError(Code.BAD_BASELINE, f"{BASELINES}, feature {feature!r:.80}", message)


def _interval(feature: Feature, plant: PlantDescription) -> Interval:
    """What the feature can be while its tags are inside their ranges."""
    ranges = {tag.name: (tag.range.low, tag.range.high) for tag in plant.tags}
    low, high = span(feature.expression.root, ranges)
    if feature.accumulation is None:
        return low, high
    least, most = span(feature.accumulation.root, ranges)
    return least - most - feature.window_s * high, most - least - feature.window_s * low


def _refuse_absurd(found: Baseline, feature: Feature, interval: Interval) -> None:
    """GraphError for values that no samples can have: they would make monitoring blind, or cry at everything."""
    slack = _SLACK * (interval[1] - interval[0])
    low, high, unit = interval[0] - slack, interval[1] + slack, in_unit(feature.unit)
    for name in ("mean", *_PERCENTILES):
        value = getattr(found, name)
        if value < low or value > high:
            message = f"{name} = {value:.6g}{unit} is outside {low:.6g} to {high:.6g}{unit}"
            raise _bad(found.feature, f"{message}, which the ranges of its tags allow")
    # 98 % of the samples are between p01 and p99, and none is farther away than the tags allow.
    sd = math.hypot(found.within_sd, found.between_sd)
    most = math.hypot((found.p99 - found.p01) / 2.0, math.sqrt(0.02) * (high - low))
    if sd > most:
        message = f"has deviations of together {sd:.6g}{unit}; the ranges of its tags allow at most {most:.6g}{unit}"
        raise _bad(found.feature, message)
    # One-sided Chebyshev: how far a percentile of any distribution can be from its mean.
    rounding = 1e-5 * max(abs(found.mean), sd, *(abs(getattr(found, name)) for name in _PERCENTILES))
    for name, share in _PERCENTILES.items():
        below, above = sd * math.sqrt((1.0 - share) / share), sd * math.sqrt(share / (1.0 - share))
        value = getattr(found, name)
        if not found.mean - below - rounding <= value <= found.mean + above + rounding:
            message = f"{name} = {value:.6g}{unit} cannot be with mean {found.mean:.6g} and deviation {sd:.6g}{unit}"
            raise _bad(found.feature, message)


def digest_of(sources: Mapping[str, object]) -> str:
    """Digest of ``sources``, values that JSON can say."""
    return hashlib.sha256(json.dumps(sources, sort_keys=True, separators=(",", ":")).encode("ascii")).hexdigest()
