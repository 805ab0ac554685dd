"""What runs and traces leave: columns as NumPy arrays, summaries as dictionaries."""

from __future__ import annotations

import html
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._standstill import Table


class Columns:
    """A table: its columns by their names, as in the files that the command line writes, and as many rows as ``len`` says.

    The arrays are views of one memory and cannot be written to. Empty cells are NaN in numbers and flags (flags are 1 and
    0), and texts without characters. ``table.to_pandas()``,
    ``polars.DataFrame(table)`` and ``pyarrow.table(table)`` read numbers where they are. Tables can be pickled and copied, so that
    pools of processes return them.
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
        return iter(self._names())

    def __contains__(self, name: object) -> bool:
        return name in self._names()

    def __len__(self) -> int:
        """How many rows there are, as of a data frame."""
        return 0 if self._table is None else len(self._table)

    def keys(self) -> list[str]:
        """The names of the columns."""
        return self._names()

    def values(self) -> Iterator[npt.NDArray[Any]]:
        """The columns."""
        return (self[name] for name in self)

    def items(self) -> Iterator[tuple[str, npt.NDArray[Any]]]:
        """The columns with their names."""
        return ((name, self[name]) for name in self)

    def get(self, name: str, default: Any = None) -> Any:
        """A column, or ``default`` where there is none of this name."""
        return self[name] if name in self else default

    def _names(self) -> list[str]:
        return [] if self._table is None else self._table.keys()

    def __repr__(self) -> str:
        return f"<{len(self)} rows of {', '.join(self)}>"

    def masked(self, name: str) -> np.ma.MaskedArray[Any, Any]:
        """A column with its empty cells masked: an angle of a start that found none is no number."""
        column = self[name]
        empty = column == "" if column.dtype == object else np.isnan(column) if column.dtype.kind == "f" else False
        return np.ma.MaskedArray(column, mask=empty)

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame`` that reads numbers where they are."""
        import pandas  # type: ignore[import-untyped, unused-ignore]

        return pandas.DataFrame(dict(self.items()), copy=False)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """Columns are no array: without this error ``pandas.DataFrame(table)`` would make one column of their names."""
        raise TypeError("a table is no array: use table['a column'], table.to_pandas() or pandas.DataFrame(dict(table))")

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """For programs that read Arrow."""
        if self._table is None:
            raise ValueError("there are no rows")
        return self._table.__arrow_c_stream__(requested_schema)

    def __getstate__(self) -> dict[str, Any]:
        own = {name: value for name, value in self.__dict__.items() if name not in ("_table", "_arrays")}
        return {**own, "_parts": None if self._table is None else self._table.parts()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        parts = state.pop("_parts")
        self.__dict__.update(state, _table=None if parts is None else Table.of_parts(*parts), _arrays={})


class Results(Columns):
    """The trials of a run, and its statistics.

    >>> import standstill as st
    >>> results = st.run('trials = 50\\n[detector]\\nmethod = "bipolar"')
    >>> results["axis_error_deg"].shape, results.summary["trials"], len(results)
    ((50,), 50, 50)
    """

    #: What was run: version, numerics, seed, scenario with all overrides.
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

    def _facts(self) -> list[tuple[str, str]]:
        """What a reader looks at first."""
        whole = self.summary or {}
        facts = [("trials", str(whole.get("trials", len(self))))]
        for name, label, unit in (
            ("rms_deg", "rms error of the axis", "°"),
            ("wrong_poles", "wrong poles", ""),
            ("undetermined", "pole undetermined", ""),
            ("failed", "failed", ""),
        ):
            value = whole.get(name)
            if isinstance(value, dict):
                value = value.get("value")
            if value is not None:
                facts.append((label, f"{value:.4g}{unit}"))
        return [*facts, ("points of the axes", str(len(self.points)))] if self.points else facts

    def __repr__(self) -> str:
        return f"<Results: {', '.join(f'{label} {value}' for label, value in self._facts())}>"

    def _repr_html_(self) -> str:
        """For notebooks: what a reader looks at first, and the first rows."""
        cell = html.escape
        facts = "".join(f"<tr><th>{cell(label)}</th><td>{cell(value)}</td></tr>" for label, value in self._facts())
        names = list(self)[:8]
        more = "<th>…</th>" if len(list(self)) > len(names) else ""
        head = "".join(f"<th>{cell(name)}</th>" for name in names) + more
        rows = "".join(
            "<tr>" + "".join(f"<td>{cell(str(self[name][row]))}</td>" for name in names) + "</tr>"
            for row in range(min(5, len(self)))
        )
        return f"<table>{facts}</table><table><tr>{head}</tr>{rows}</table>"

    def plot(self, ax: Any = None) -> Any:
        """The error of the axis over the rotor's angle, with wrong poles and undetermined ones marked; matplotlib's axes.

        ``ax``: matplotlib's axes to draw on; new ones without.
        """
        from matplotlib import pyplot

        if len(self) == 0:
            raise ValueError("there are no rows to draw: run with rows='all'")
        axes = pyplot.subplots(figsize=(7, 4), layout="constrained")[1] if ax is None else ax
        angle, error, outcome = self["true_angle_deg"], self["axis_error_deg"], self["outcome"]
        wrong = self["pole_correct"] == 0
        undetermined = outcome == "undetermined"
        right = (outcome == "found") & ~wrong
        axes.plot(angle[right], error[right], ".", ms=2, color="0.35", label="right pole")
        axes.plot(angle[undetermined], error[undetermined], "o", ms=4, mfc="none", color="C0", label="pole undetermined")
        axes.plot(angle[wrong], error[wrong], "x", ms=6, color="C3", label="wrong pole")
        failed = int((outcome == "failed").sum())
        axes.set(
            xlabel="rotor angle (electrical degrees)",
            ylabel="error of the axis (°)",
            xlim=(0, 360),
            xticks=range(0, 361, 60),
            title=f"{len(self)} starts" + (f", {failed} without an axis" if failed else ""),
        )
        axes.grid(alpha=0.3)
        axes.legend(loc="best", fontsize="small")
        return axes


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
