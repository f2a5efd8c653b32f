"""Compiles the plants' kernels, or reads what was compiled: once, before many processes need them at the same time."""

from __future__ import annotations

from homeostat.plants.files.places import shipped_names
from homeostat.plants.plant import load_plant
from homeostat.process.kernel import CompiledKernel

for plant in shipped_names():
    kernel = load_plant(plant, learned=False).model.kernel
    assert isinstance(kernel, CompiledKernel)
    kernel.load()
