"""What runs and traces leave: columns as NumPy arrays, summaries as dictionaries."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy.typing as npt

from ._standstill import Table


class Columns:
    """A table: its columns by their names, as in the files that the command line writes, and as many rows as ``len`` says.

    The arrays are views of one memory and cannot be written to. Empty cells are NaN in numbers and flags (flags are 1 and
    0), and texts without characters. ``pandas.DataFrame(dict(table), copy=False)``, ``polars.DataFrame(table)`` and
    ``pyarrow.table(table)`` read numbers where they are.
    """

    def __init__(self, table: Table | None) -> None:
        self._table = table
        self._arrays: dict[str, npt.NDArray[Any]] = {}

    def __getitem__(self, name: str) -> npt.NDArray[Any]:
        if name not in self._arrays:
            if self._table is None:
                raise KeyError(f"no column `{name}`: there are no rows (rows='none', or results that were there already)")
            self._arrays[name] = self._table[name]
        return self._arrays[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.keys())

    def __contains__(self, name: object) -> bool:
        return name in self.keys()

    def __len__(self) -> int:
        """How many rows there are."""
        return 0 if self._table is None else len(self._table)

    def keys(self) -> list[str]:
        """The names of the columns."""
        return [] if self._table is None else self._table.keys()

    def items(self) -> Iterator[tuple[str, npt.NDArray[Any]]]:
        """The columns with their names."""
        return ((name, self[name]) for name in self.keys())

    def __repr__(self) -> str:
        return f"<{len(self)} rows of {', '.join(self.keys())}>"

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """For programs that read Arrow."""
        if self._table is None:
            raise ValueError("there are no rows")
        return self._table.__arrow_c_stream__(requested_schema)


class Results(Columns):
    """The trials of a run, and its statistics.

    >>> import standstill as st
    >>> results = st.run('trials = 50\\n[detector]\\nmethod = "bipolar"')
    >>> results["axis_error_deg"].shape, results.summary["trials"], len(results)
    ((50,), 50, 50)
    """

    #: What was run: version, seed, scenario with all overrides.
    run: dict[str, Any]
    #: Statistics of all trials, see docs/campaigns.md; empty with axes, whose points were chosen.
    summary: dict[str, Any]
    #: Values and statistics of each point of the axes; empty without axes.
    points: list[dict[str, Any]]
    #: Where the files are, if any were asked for.
    folder: Path | None

    def __init__(self, table: Table | None, file: dict[str, Any], folder: Path | None) -> None:
        super().__init__(table)
        self.run = file["run"]
        self.summary = file.get("summary", {})
        self.points = file.get("points", [])
        self.folder = folder


class Trace:
    """One detection: every waveform of it.

    >>> import standstill as st
    >>> trace = st.trace(method="bipolar", angle=40.0)
    >>> bool(abs(trace.result["error_deg"]) < 3.0), "i_a_A" in trace.waveform, "sample" in set(trace.events["event"])
    (True, True, True)
    """

    #: What the detector found and measured, what was drawn for it, and where the energy went.
    result: dict[str, Any]
    #: Every quantity over time, as in waveform.csv.
    waveform: Columns
    #: Gate edges, changes of conduction and samples, as in events.csv.
    events: Columns

    def __init__(self, tables: dict[str, Table], result: dict[str, Any]) -> None:
        self.result = result
        self.waveform = Columns(tables["waveform"])
        self.events = Columns(tables["events"])
