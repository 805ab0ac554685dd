"""What runs and traces leave: columns as NumPy arrays, summaries as dictionaries."""

from __future__ import annotations

import html
from collections.abc import Mapping
from copy import deepcopy
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from ._standstill import Table


class Columns(dict[str, npt.NDArray[Any]]):
    """A table: a mapping from the names of its columns to arrays, as the files of the command line have them.

    Arrays cannot be written to. Numbers are read where they are; flags are booleans. A column with empty cells is a masked
    array: an undetermined start has no error. ``pandas.DataFrame(table)``, ``polars.DataFrame(table)`` and
    ``pyarrow.table(table)`` make tables of it; :meth:`to_pandas` and :meth:`to_arrow` also carry :attr:`metadata`.
    Tables can be pickled and copied, so that pools of processes return them.

    pandas takes no mapping but ``dict``, so this is one.
    """

    #: Version, numerics, seed, scenario: as the metadata of a Parquet file.
    metadata: dict[str, str]

    def __init__(self, table: Table | None, metadata: dict[str, str]) -> None:
        super().__init__()
        self.metadata = metadata
        self._table = table
        self._kinds: dict[str, str] = {}
        for name in () if table is None else table.keys():
            column = table.column(name) if table else None
            if column:
                self._kinds[name], cells, empty = column
                fill = "" if self._kinds[name] == "text" else None
                if empty is not None:
                    cells = np.ma.MaskedArray(cells, mask=empty, copy=False, fill_value=fill)
                dict.__setitem__(self, name, cells)

    @property
    def rows(self) -> int:
        """How many rows there are; ``len`` is the number of columns, as of any mapping."""
        return 0 if self._table is None else len(self._table)

    def __missing__(self, name: str) -> NoReturn:
        if self._table is None:
            raise KeyError(f"no column `{name}`: there are no rows (rows='none', or results that were there already)")
        raise KeyError(f"no column `{name}`; there are {', '.join(self)}")

    def _fixed(self, *_: Any, **__: Any) -> NoReturn:
        raise TypeError("a table of results cannot be changed: dict(table) or table.to_pandas() can")

    __setitem__ = __delitem__ = __ior__ = clear = pop = popitem = setdefault = update = _fixed

    def __eq__(self, other: object) -> bool:
        return type(other) is type(self) and self._state() == other._state() and self._same(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None

    def _same(self, other: Columns) -> bool:
        """Whether all cells are equal, empty ones too."""
        tables = (self._table, other._table)
        return tables[0] is tables[1] or None not in tables and tables[0].parts() == tables[1].parts()  # type: ignore[union-attr]

    def _state(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name not in ("_table", "_kinds")}

    def __repr__(self) -> str:
        return f"<{self.rows} rows of {', '.join(self)}>"

    def to_pandas(self) -> Any:
        """A ``pandas.DataFrame`` in whose columns empty cells are ``NA``: ``Float64``, ``boolean``, ``string``, and ``int64`` of
        columns without empty cells. Numbers are read where they are. Its ``attrs`` are :attr:`metadata`."""
        import pandas  # type: ignore[import-untyped, unused-ignore]

        def column(name: str) -> Any:
            cells, empty, kind = np.ma.getdata(self[name]), np.ma.getmaskarray(self[name]), self._kinds[name]
            if kind == "number":
                return pandas.arrays.FloatingArray(cells, empty, copy=False)
            if kind == "flag":
                return pandas.arrays.BooleanArray(cells, empty, copy=False)
            return cells if kind == "whole" else pandas.array(np.where(empty, np.array(None, dtype=object), cells), dtype="string")

        frame = pandas.DataFrame({name: column(name) for name in self}, copy=False)
        frame.attrs.update(self.metadata)
        return frame

    def to_arrow(self) -> Any:
        """A ``pyarrow.Table`` whose schema has :attr:`metadata`, without a copy but of flags."""
        import pyarrow  # type: ignore[import-untyped, unused-ignore]

        return pyarrow.RecordBatchReader.from_stream(self).read_all()

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object:
        """For programs that read Arrow."""
        if self._table is None:
            raise ValueError("there are no rows")
        return self._table.stream(self.metadata)

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), None if self._table is None else self._table.parts(), self._state())

    def copy(self) -> Any:
        """The same table once more."""
        return _again(*self.__reduce__()[1])

    __copy__ = copy

    def __deepcopy__(self, _: Any) -> Any:
        return _again(type(self), self.__reduce__()[1][1], deepcopy(self._state()))


def _again(of: type[Columns], parts: Any, state: dict[str, Any]) -> Columns:
    """A table of what a pickle has."""
    table = of.__new__(of)
    Columns.__init__(table, None if parts is None else Table.of_parts(*parts), state["metadata"])
    table.__dict__.update(state)
    return table


def _metadata(run: Mapping[str, Any]) -> dict[str, str]:
    """Of a run or a trace, what files in Parquet say of it."""
    files = "\n".join(f"{path}: {digest}" for path, digest in dict(run.get("files") or {}).items())
    found = {name: str(run[name]) for name in ("version", "numerics", "seed", "scenario") if name in run}
    return {**found, "files": files} if files else found


class Results(Columns):
    """The trials of a run, and its statistics.

    >>> import standstill as st
    >>> results = st.run('trials = 50\\n[detector]\\nmethod = "bipolar"')
    >>> results["axis_error_deg"].shape, results.summary["trials"], results.rows
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
        super().__init__(table, _metadata(file["run"]))
        self.run = file["run"]
        self.summary = file.get("summary", {})
        self.points = file.get("points", [])
        self.folder = folder

    def _facts(self) -> list[tuple[str, str]]:
        """What a reader looks at first."""
        whole = self.summary or {}
        facts = [("trials", str(whole.get("trials", self.rows)))]
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
        more = "<th>…</th>" if len(self) > len(names) else ""
        head = "".join(f"<th>{cell(name)}</th>" for name in names) + more
        rows = "".join(
            "<tr>" + "".join(f"<td>{cell(str(self[name][row]))}</td>" for name in names) + "</tr>"
            for row in range(min(5, self.rows))
        )
        return f"<table>{facts}</table><table><tr>{head}</tr>{rows}</table>"

    def plot(self, ax: Any = None) -> Any:
        """The error of the axis over the rotor's angle, with wrong poles and undetermined ones marked; matplotlib's axes.

        ``ax``: matplotlib's axes to draw on; new ones without.
        """
        from matplotlib import pyplot

        if self.rows == 0:
            raise ValueError("there are no rows to draw: run with rows='all'")
        axes = pyplot.subplots(figsize=(7, 4), layout="constrained")[1] if ax is None else ax
        angle, error, outcome = self["true_angle_deg"], self["axis_error_deg"], self["outcome"]
        wrong = np.ma.filled(self["pole_correct"] == 0, False)
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
            title=f"{self.rows} starts" + (f", {failed} without an axis" if failed else ""),
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
        self.waveform = Columns(tables["waveform"], _metadata(result))
        self.events = Columns(tables["events"], _metadata(result))
