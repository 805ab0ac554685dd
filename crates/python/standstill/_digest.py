"""What the record of a run calls a detector written in Python: its module, its class and a digest of what that computes.

The digest is made of the compiled source, as it is in memory: a file that was changed and not loaded again counts as it was loaded,
and a class of a notebook or of the prompt, which has no file, counts as any other. With the class go its bases, what its methods
refer to by a global name or take out of own modules, however many lie between, and the values that they were given (arguments of
``functools.partial``, variables around a ``lambda``). Of what is installed, the standard library and packages, the name alone counts.
"""

from __future__ import annotations

import dis
import functools
import hashlib
import importlib.util
import os
import pickle
import sys
import sysconfig
import types
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

#: Where installed code is.
_PLACES = tuple({os.path.realpath(sysconfig.get_paths()[name]) for name in ("stdlib", "platstdlib", "purelib", "platlib")})

_PLAIN = (type(None), bool, int, float, complex, str, bytes, type(Ellipsis), type(NotImplemented))

#: What a class has without being written.
_MADE = {"__dict__", "__weakref__", "__module__", "__doc__", "__qualname__", "__annotations__", "__firstlineno__"}
_MADE |= {"__static_attributes__", "__annotate__", "__annotate_func__", "__annotations_cache__", "__dataclass_fields__", "_abc_impl"}


def name(detector: Any) -> str:
    """``module.Class@cpython3.11:digest`` of a class, or of whatever else makes a detector when it is called.

    >>> from standstill._digest import name
    >>> own = {"__name__": "own"}
    >>> exec("def made(pulse): return lambda: pulse", own)
    >>> made = own["made"]
    >>> name(made(80e-6)) == name(made(80e-6)), name(made(80e-6)) == name(made(90e-6))
    (True, False)
    """
    walk = _Walk()
    walk.value(detector)
    of = detector
    while isinstance(of, functools.partial):
        of = of.func
    if not hasattr(of, "__qualname__"):
        of = type(of)
    version = f"{sys.implementation.name}{sys.version_info.major}.{sys.version_info.minor}"
    return f"{_module(of.__module__)}.{of.__qualname__}@{version}:{walk.hash.hexdigest()[:16]}"


def _module(name: str) -> str:
    """A module's name; of a program, that of its file."""
    file = getattr(sys.modules.get(name), "__file__", None)
    return Path(file).stem if name == "__main__" and file else name


def _installed(name: str | None) -> bool:
    """Whether a module is none of the user's own."""
    if name is None or name == "__main__":
        return False
    top = name.partition(".")[0]
    if top in sys.stdlib_module_names or top == __name__.partition(".")[0]:
        return True
    file = getattr(sys.modules.get(name), "__file__", None)
    return file is not None and os.path.realpath(file).startswith(_PLACES)


class _Walk:
    """From a class to all that it is made of."""

    def __init__(self) -> None:
        self.hash = hashlib.sha256()
        # What was met, by its address, which holds for as long as it is kept.
        self.met: dict[int, tuple[int, object]] = {}
        # Modules, with what was taken out of them.
        self.passed: set[tuple[str, tuple[str, ...]]] = set()

    def words(self, *words: object) -> None:
        for word in words:
            text = word if isinstance(word, bytes) else str(word).encode("utf-8", "surrogatepass")
            self.hash.update(b"%d:" % len(text) + text)

    def value(self, value: Any) -> None:
        if isinstance(value, _PLAIN):
            return self.words(type(value).__name__, repr(value))
        # Whether equal constants are one object is the interpreter's matter.
        if not isinstance(value, (tuple, frozenset, types.CodeType)):
            if id(value) in self.met:
                return self.words("again", self.met[id(value)][0])
            self.met[id(value)] = (len(self.met), value)
        self.words(type(value).__qualname__)
        if isinstance(value, (tuple, list)):
            self.all(value)
        elif isinstance(value, (set, frozenset)):
            self.words(*sorted(map(repr, value)))
        elif isinstance(value, Mapping):
            self.all(part for key in sorted(value, key=repr) for part in (key, value[key]))
        elif isinstance(value, (np.ndarray, np.generic)) and not value.dtype.hasobject:
            self.words(value.dtype.str, value.shape, value.tobytes())
        elif isinstance(value, types.CodeType):
            self.code(value)
        elif isinstance(value, types.FunctionType):
            self.function(value)
        elif isinstance(value, types.MethodType):
            self.all((value.__func__, value.__self__))
        elif isinstance(value, (staticmethod, classmethod)):
            self.value(value.__func__)
        elif isinstance(value, property):
            self.all((value.fget, value.fset, value.fdel))
        elif isinstance(value, functools.partial):
            self.all((value.func, value.args, value.keywords))
        elif isinstance(value, types.ModuleType):
            self.module(value, set())
        elif isinstance(value, type):
            self.of_class(value)
        else:
            self.instance(value)

    def all(self, values: Iterable[Any]) -> None:
        for value in values:
            self.value(value)
        self.words("end")

    def code(self, code: types.CodeType) -> None:
        """Without where it stands in its file."""
        self.words(code.co_code, code.co_argcount, code.co_posonlyargcount, code.co_kwonlyargcount, code.co_flags)
        self.words(*code.co_names, *code.co_varnames, *code.co_freevars, getattr(code, "co_exceptiontable", b""))
        self.all(code.co_consts)

    def function(self, function: types.FunctionType) -> None:
        self.words(function.__module__ if _installed(function.__module__) else "own", function.__qualname__)
        if _installed(function.__module__):
            return
        self.all((function.__code__, function.__defaults__, function.__kwdefaults__))
        for cell in function.__closure__ or ():
            try:
                self.value(cell.cell_contents)
            except ValueError:
                self.words("empty")
        known = function.__globals__
        names, attributes = _named(function.__code__)
        for name in sorted(names & known.keys()):
            self.words(name)
            if isinstance(known[name], types.ModuleType):
                self.module(known[name], attributes)
            else:
                self.value(known[name])
        for name, taken in sorted(_imported(function.__code__, known.get("__package__"))):
            self.words(name)
            try:
                self.module(importlib.import_module(name), attributes | set(taken))
            except ImportError:
                self.words("absent")

    def module(self, module: types.ModuleType, attributes: set[str]) -> None:
        """An own module: what a code takes out of it, by way of further modules too. Where that is nothing by name, all that it has."""
        self.words(module.__name__)
        if _installed(module.__name__):
            return
        held = vars(module)
        taken = sorted(attributes & held.keys())
        if not taken:
            kinds = (*_PLAIN, types.FunctionType, types.ModuleType, type)
            taken = sorted(name for name, value in held.items() if isinstance(value, kinds) and not name.startswith("__"))
        if (key := (module.__name__, tuple(taken))) in self.passed:
            return
        self.passed.add(key)
        for name in taken:
            self.words(name)
            if isinstance(held[name], types.ModuleType):
                self.module(held[name], attributes)
            else:
                self.value(held[name])

    def of_class(self, of: type) -> None:
        self.words(of.__qualname__)
        if _installed(of.__module__):
            return self.words(of.__module__)
        self.all(of.__bases__)
        self.all(part for key in sorted(vars(of).keys() - _MADE) for part in (key, vars(of)[key]))

    def instance(self, value: object) -> None:
        """An object by its class and what it keeps; one that does not show that, by its class alone."""
        self.value(type(value))
        if not _installed(type(value).__module__):
            slots = [name for of in type(value).__mro__ for name in getattr(of, "__slots__", ())]
            self.value({**getattr(value, "__dict__", {}), **{name: getattr(value, name, None) for name in slots}})
            return
        try:
            self.words(pickle.dumps(value, protocol=4))
        except Exception:  # noqa: BLE001 - whatever an object says that cannot be kept
            self.words(getattr(value, "__qualname__", "closed"))


def _named(code: types.CodeType) -> tuple[set[str], set[str]]:
    """The global names that a code refers to, and its attributes, with those of the code within it."""
    instructions = list(dis.get_instructions(code))
    names = {i.argval for i in instructions if i.opname in ("LOAD_GLOBAL", "LOAD_NAME")}
    attributes = {i.argval for i in instructions if i.opname in ("LOAD_ATTR", "LOAD_METHOD")}
    for const in code.co_consts:
        if isinstance(const, types.CodeType):
            more = _named(const)
            names, attributes = names | more[0], attributes | more[1]
    return names, attributes


def _imported(code: types.CodeType, package: str | None) -> set[tuple[str, tuple[str, ...]]]:
    """The modules that a code imports when it runs, by their full names, each with what is taken from it."""
    instructions = list(dis.get_instructions(code))
    found = set()
    for level, taken, i in zip(instructions, instructions[1:], instructions[2:]):
        if i.opname == "IMPORT_NAME":
            name = "." * level.argval + i.argval
            name = importlib.util.resolve_name(name, package or "") if level.argval else name
            # `import a.b` gives `a`, from which the code takes `b`.
            found.add((name, tuple(taken.argval)) if taken.argval else (name.partition(".")[0], ()))
            if not taken.argval and "." in name:
                found.add((name, ()))
    for const in code.co_consts:
        if isinstance(const, types.CodeType):
            found |= _imported(const, package)
    return found
