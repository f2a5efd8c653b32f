"""Compiles the plants' kernels, or reads what was compiled: once, before many processes need them at the same time."""

from __future__ import annotations

from homeostat.plants.cstr.kernel import advance as reactor
from homeostat.plants.mixing_module.kernel import advance as module

for kernel in (reactor, module):
    kernel.load()
