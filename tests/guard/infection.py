"""Give a loaded module the code of a mutant."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from types import FunctionType, ModuleType

from tests.guard.mutants import Mutant


def infect(mutant: Mutant) -> None:
    """Give the functions of the loaded module the mutant's code; whoever holds one of them runs it from now on."""
    changed = ModuleType(mutant.module)
    sys.modules[mutant.module], module = changed, sys.modules[mutant.module]
    exec(compile(mutant.tree(), f"<mutant of {mutant.module}>", "exec"), changed.__dict__)
    sys.modules[mutant.module] = module
    _spread(module, changed)
    _spread_in_classes(module, changed)
    theirs = dict(functions(changed))
    for name, function in functions(module):
        function.__code__, function.__defaults__ = theirs[name].__code__, theirs[name].__defaults__


def _spread(module: ModuleType, changed: ModuleType) -> None:
    """Give everybody who holds a constant of ``module`` that of the ``changed`` one."""
    for name, value in vars(changed).items():
        old = vars(module).get(name)
        if name.startswith("__") or isinstance(value, ModuleType | FunctionType | type) or old == value:
            continue
        package = module.__name__.rpartition(".")[0]
        for other in [m for n, m in sys.modules.items() if n.startswith(package)]:
            if vars(other).get(name) is old:
                vars(other)[name] = value


def _spread_in_classes(owner: ModuleType | type, changed: ModuleType | type) -> None:
    """Give every class of ``owner`` the constants of the ``changed`` one."""
    for name, value in vars(owner).items():
        theirs = vars(changed).get(name)
        if isinstance(value, type) and value.__module__ == changed.__name__ and isinstance(theirs, type):
            _spread_in_classes(value, theirs)
        elif isinstance(owner, type) and type(value) in (bool, int, float, str) and theirs != value:
            setattr(owner, name, theirs)


def functions(owner: ModuleType | type) -> Iterator[tuple[str, FunctionType]]:
    """Every function of a module and of its classes, properties included, by name."""
    module = owner.__name__ if isinstance(owner, ModuleType) else owner.__module__
    for value in vars(owner).values():
        function = value.fget if isinstance(value, property) else getattr(value, "__func__", value)
        if isinstance(function, FunctionType) and function.__module__ == module:
            yield function.__qualname__, function
        elif isinstance(function, type) and function.__module__ == module:
            yield from functions(function)
