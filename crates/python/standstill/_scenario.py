"""Scenarios: a file or a text, with keys in place of what it has."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias, Union

import numpy as np

from ._types import ScenarioDict

Pathlike: TypeAlias = Union[str, "os.PathLike[str]"]

#: What a scenario given as a text is called in messages.
NAME = "scenario.toml"


@dataclass(frozen=True)
class Scenario:
    """A scenario: a file's path or a text, and keys set in place of what it has. Made by :func:`scenario`."""

    path: str
    text: str | None = None
    keys: Mapping[str, str] = field(default_factory=dict)

    @property
    def given(self) -> tuple[str, str] | None:
        """The text that stands for a file, with its name."""
        return None if self.text is None else (self.path, self.text)

    def words(self) -> list[str]:
        """As the command line has it."""
        return [self.path, *(word for key, value in self.keys.items() for word in ("-s", f"{key}={value}"))]


#: A scenario as functions take it: made by :func:`scenario`, a file's path, a text, or a dictionary.
Source: TypeAlias = Union[Scenario, Pathlike, ScenarioDict, Mapping[str, Any]]


def scenario(source: Source, /, **overrides: Any) -> Scenario:
    """A scenario from a file's path, from its text or from a dictionary, with other values for some keys.

    A ``str`` with a line end or an ``=`` in it is a text. Keys are given as they are nested, or with dots in a dictionary.

    >>> import standstill as st
    >>> text = '[detector]\\nmethod = "bipolar"\\n'
    >>> quick = st.scenario(text, trials=20, sensors={"noise": "20 mA"}, **{"inverter.dead_time": "1.5 us"})
    >>> quick.keys["sensors.noise"]
    '"20 mA"'
    >>> st.run(quick).summary["trials"]
    20
    >>> st.run({"trials": 20, "detector": {"method": "bipolar"}}).summary["trials"]
    20
    """
    if isinstance(source, Scenario):
        base = source
    elif isinstance(source, Mapping):
        base = Scenario(NAME, "", dict(_flat(source)))
    elif isinstance(source, str) and ("\n" in source or "=" in source or not source):
        base = Scenario(NAME, source)
    else:
        base = Scenario(os.fspath(source))
    return Scenario(base.path, base.text, {**base.keys, **dict(_flat(overrides))})


def _flat(table: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    for key, value in table.items():
        name = f"{above}{key}"
        # The keys of axes and tolerances have dots in them, and tables as values.
        table_of_keys = name in ("axes", "tolerances")
        if isinstance(value, Mapping) and not above.startswith(("axes.", "tolerances.")) and (value or not table_of_keys):
            yield from _flat(value, f"{name}.")
        else:
            yield name, toml(value)


def toml(value: Any) -> str:
    """A value as TOML has it."""
    if isinstance(value, (bool, np.bool_)):
        return "true" if value else "false"
    if isinstance(value, (int, np.integer)):
        return str(int(value))
    if isinstance(value, (float, np.floating)):
        return repr(float(value))
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, os.PathLike):
        return json.dumps(os.fspath(value), ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(k))} = {toml(v)}" for k, v in value.items()) + " }"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(toml(item) for item in value) + "]"
    raise TypeError(f"{value!r} is no value of a scenario: needed a number, a text, a flag, a list or a dictionary")
