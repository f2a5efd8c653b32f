"""The detectors by name; those that need a library load it when they learn."""

from collections.abc import Callable, Mapping, Sequence
from importlib.util import find_spec
from typing import Final

from homeostat.detectors.detector import Detector
from homeostat.detectors.error import DetectionError
from homeostat.detectors.kinds.autoencoder import Autoencoder
from homeostat.detectors.kinds.cusum import Cusum
from homeostat.detectors.kinds.cva import Cva
from homeostat.detectors.kinds.ewma import Ewma
from homeostat.detectors.kinds.isolation_forest import IsolationForest
from homeostat.detectors.kinds.pca import Pca
from homeostat.detectors.kinds.three_sigma import ThreeSigma

KINDS: Final[Mapping[str, Callable[[int], Detector]]] = {
    "three-sigma": lambda seed: ThreeSigma(),
    "cusum": lambda seed: Cusum(),
    "ewma": lambda seed: Ewma(),
    "pca": lambda seed: Pca(),
    "cva": lambda seed: Cva(),
    "isolation-forest": IsolationForest,
    "autoencoder": Autoencoder,
}
"""Name -> what makes the detector from a seed."""
NEEDED: Final = {"isolation-forest": "sklearn", "autoencoder": "sklearn"}
"""Detector -> what it imports, which the extra ``monitor`` installs."""
ALL: Final = "all"
"""Stands for every detector that can be had here."""
USUAL: Final = ("ewma", "cva")
"""What is combined unless something else is asked for: signal by signal, and all of them together."""


def detectors(names: Sequence[str], seed: int) -> tuple[Detector, ...]:
    """The detectors called ``names``, once each; DetectionError where one is unknown, or its library is missing."""
    asked = [name for name in KINDS if _here(name)] if list(names) == [ALL] else list(dict.fromkeys(names))
    for name in asked:
        if name not in KINDS:
            raise DetectionError(f"{name!r} is no detector; there are {', '.join(KINDS)}, and {ALL} for all of them")
        if not _here(name):
            raise DetectionError(f"{name} needs scikit-learn; install it with: pip install 'homeostat[monitor]'")
    return tuple(KINDS[name](seed) for name in asked)


def _here(name: str) -> bool:
    return name not in NEEDED or find_spec(NEEDED[name]) is not None
