"""The commands."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeAlias, Union

from . import _digest, _standstill
from ._detector import Detector, takes
from ._results import Results, Trace
from ._scenario import Pathlike, Scenario, Source, scenario as _scenario, toml
from ._standstill import Table
from ._types import DesignKind, Effort, ErrorSet, FaultMode, Format, MethodName, Rotor, Rows

#: See :func:`run`.
Progress: TypeAlias = Union[Callable[[int, int], object], bool, None]


def _options(options: Mapping[str, Any]) -> list[str]:
    """Keywords as options: ``stop_at={"rms": "2%"}`` is ``--stop-at rms=2%``."""
    words: list[str] = []
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if value is None or value is False:
            continue
        if value is True:
            words.append(option)
        elif isinstance(value, Mapping):
            for key, setting in value.items():
                words += [option, f"{key}={_axis(setting) if name == 'vary' else _plain(setting)}"]
        elif isinstance(value, (list, tuple)):
            for item in value:
                words += [option, _plain(item)]
        else:
            words += [option, _plain(value)]
    return words


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else os.fspath(value) if isinstance(value, os.PathLike) else toml(value)


#: Values of an axis: as the command line has them, such as "5 mA:50 mA:3", or one after the other.
Axis: TypeAlias = Union[str, Iterable[Union[str, float]]]


def _axis(values: Axis) -> str:
    """An axis as the command line has it; an array's elements are plain numbers."""
    if isinstance(values, str) or not isinstance(values, Iterable):
        return _plain(values)
    plain = [value.item() if hasattr(value, "item") else value for value in values]
    return ",".join(_plain(value) for value in plain)


def _paths(paths: Iterable[Pathlike] | Pathlike) -> list[str]:
    """Several paths, or one: a text is no list of its letters."""
    return [os.fspath(path) for path in ([paths] if isinstance(paths, (str, os.PathLike)) else paths)]


def _words(command: str, source: Source | None) -> tuple[list[str], tuple[str, str] | None]:
    if source is None:
        return [command], None
    given = _scenario(source)
    return [command, *given.words()], given.given


#: A class of detectors, or the path of a library.
Detectors: TypeAlias = Union[Callable[..., Detector], Pathlike, None]
_Class: TypeAlias = Union[tuple[Callable[..., Detector], str, list[str]], None]


def _detected(source: Source, detector: Detectors) -> tuple[Scenario, _Class]:
    """A scenario with a library for its detector, or with a class that is given beside it."""
    of = _scenario(source)
    if detector is None:
        return of, None
    if callable(detector):
        return of, (detector, _digest.name(detector), takes(detector))
    if not isinstance(detector, (str, os.PathLike)):
        raise TypeError(f"detector: found {detector!r}, needed a class whose objects have `step`, or the path of a library")
    return _scenario(of, **{"detector.library": os.path.abspath(detector)}), None


def _answer(
    command: str, source: Source | None, progress: Progress = None, detector: Detectors = None, more: Sequence[str] = (), /, **options: Any
) -> Any:
    """What a command prints as JSON; ``more`` are its words behind the scenario. A further command is a function with this call."""
    made: _Class = None
    if detector is not None:
        source, made = _detected("" if source is None else source, detector)
    words, given = _words(command, source)
    _, text, _ = _standstill.command([*words, *more, "--json", *_options(options)], given, False, progress, made)
    return json.loads(text)


def _carried_out(
    words: list[str],
    given: tuple[str, str] | None,
    out: Pathlike | None,
    progress: Progress,
    options: dict[str, Any],
    detector: _Class = None,
) -> Results:
    """A command with trials, whose files are written if a folder is given."""
    with tempfile.TemporaryDirectory(prefix="standstill-") as folder:
        words = [*words, "--json", "--out", os.fspath(folder if out is None else out), *_options(options)]
        _, text, tables = _standstill.command(words, given, out is not None, progress, detector)
    return Results(dict(tables).get("trials"), json.loads(text), None if out is None else Path(out))


def run(
    scenario: Source,
    /,
    *,
    trials: int | None = None,
    seed: int | None = None,
    stop_at: Mapping[str, Any] | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    format: Format = "csv",
    rows: Rows = "all",
    resume: bool = False,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> Results:
    """A scenario's trials, at each point of its axes.

    With ``out`` the files of ``standstill run`` are written there, in ``format`` "csv", "parquet", "npz" or "mat", and an
    interrupted run goes on with ``resume=True``; those of another run are replaced with ``force=True``, as everywhere.
    ``rows="none"`` keeps only statistics. ``progress`` is False for no bar
    on the terminal, or a function of how many trials of how many are done. ``detector`` is a class, see ``docs/python.md``,
    which the record of the run names, or the path of a library.

    >>> import standstill as st
    >>> results = st.run('[detector]\\nmethod = "bipolar"', trials=200, seed=3)
    >>> results.rows, results.summary["undetermined"]
    (200, 0)
    >>> st.run("trials = 0")
    Traceback (most recent call last):
    ...
    standstill.Error: scenario.toml: line 1: `trials`: found 0, needed at least 1
    """
    source, made = _detected(scenario, detector)
    options: dict[str, Any] = {"trials": trials, "seed": seed, "stop_at": stop_at, "threads": threads}
    options |= {"format": format, "rows": rows, "resume": resume, "force": force}
    return _carried_out(["run", *source.words()], source.given, out, progress, options, made)


def sweep(
    scenario: Source,
    /,
    *,
    vary: Mapping[str, Axis] | None = None,
    design: DesignKind | None = None,
    points: int | None = None,
    trials: int | None = None,
    seed: int | None = None,
    stop_at: Mapping[str, Any] | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    format: Format = "csv",
    rows: Rows = "all",
    resume: bool = False,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> Results:
    """The same at the points of axes, which may be given here.

    >>> import standstill as st
    >>> results = st.sweep('[detector]\\nmethod = "bipolar"', vary={"sensors.noise": "5 mA:50 mA:3"}, trials=50)
    >>> [round(point["values"]["sensors.noise"], 4) for point in results.points], results.rows
    ([0.005, 0.0275, 0.05], 150)
    >>> results = st.sweep('[detector]\\nmethod = "bipolar"', vary={"sensors.noise": [0.005, "20 mA"]}, trials=5)
    >>> [point["values"]["sensors.noise"] for point in results.points]
    [0.005, 0.02]
    """
    source, made = _detected(scenario, detector)
    options: dict[str, Any] = {"vary": vary, "design": design, "points": points, "trials": trials, "seed": seed, "stop_at": stop_at}
    options |= {"format": format, "rows": rows, "resume": resume, "force": force, "threads": threads}
    return _carried_out(["sweep", *source.words()], source.given, out, progress, options, made)


def shard(
    scenario: Source,
    part: str,
    /,
    *,
    out: Pathlike,
    vary: Mapping[str, Axis] | None = None,
    trials: int | None = None,
    seed: int | None = None,
    stop_at: Mapping[str, Any] | None = None,
    detector: Detectors = None,
    rows: Rows = "all",
    threads: int | None = None,
    progress: Progress = None,
) -> Path:
    """A part of a run such as "3/8", in a journal in the folder ``out``; it goes on where it ended. :func:`merge` puts the
    parts together.

    >>> import standstill as st, tempfile
    >>> text = 'trials = 100\\n[detector]\\nmethod = "bipolar"'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     paths = [st.shard(text, f"{k}/2", out=folder) for k in (1, 2)]
    ...     together = st.merge([folder])
    >>> together.summary == st.run(text).summary, paths[0].name
    (True, 'shard-1-of-2.journal')
    """
    source, made = _detected(scenario, detector)
    words = ["run" if vary is None else "sweep", *source.words()]
    options: dict[str, Any] = {"vary": vary, "trials": trials, "seed": seed, "stop_at": stop_at, "rows": rows, "threads": threads}
    words += ["--json", "--resume", "--shard", part, "--out", os.fspath(out), *_options(options)]
    _, text, _ = _standstill.command(words, source.given, True, progress, made)
    return Path(json.loads(text)["journal"])


def merge(
    folders: Iterable[Pathlike] | Pathlike, /, *, out: Pathlike | None = None, format: Format = "csv", progress: Progress = None
) -> Results:
    """The shards in these folders, or in one folder, put together as the whole run would have been.

    >>> import standstill as st, tempfile
    >>> text = 'trials = 60\\n[detector]\\nmethod = "bipolar"'
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = [st.shard(text, f"{k}/3", out=folder) for k in (1, 2, 3)]
    ...     together = st.merge(folder)
    >>> together.rows, together.summary["wrong_poles"]
    (60, 0)
    """
    words = ["merge", *_paths(folders)]
    return _carried_out(words, None, out, progress, {"format": format})


def status(folders: Iterable[Pathlike] | Pathlike, /) -> dict[str, Any]:
    """Which shards in these folders are done, running, begun, missing or damaged.

    >>> import standstill as st, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = st.shard('[detector]\\nmethod = "bipolar"', "2/4", out=folder, trials=40)
    ...     status = st.status([folder])
    >>> status["array"], status["counts"]["done"]
    ('1,3,4', 1)
    """
    words = ["status", "--json", *_paths(folders)]
    answer: dict[str, Any] = json.loads(_standstill.command(words)[1])
    return answer


def trace(
    scenario: Source | None = None,
    /,
    *,
    point: int | None = None,
    trial: int | None = None,
    angle: float | None = None,
    method: MethodName | None = None,
    motor: str | None = None,
    errors: ErrorSet | None = None,
    rotor: Rotor | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    verify: bool = False,
    out: Pathlike | None = None,
    format: Format = "csv",
    force: bool = False,
) -> Trace:
    """One trial of a scenario, every waveform of it: see :class:`Trace`. With ``out`` the files of ``standstill trace`` are
    written too. ``detector``: as of :func:`run`.

    >>> import standstill as st
    >>> trace = st.trace(method="bipolar", angle=40.0)
    >>> trace.result["outcome"], trace.waveform.rows > 100
    ('found', True)
    """
    made: _Class = None
    if detector is not None:
        scenario, made = _detected("" if scenario is None else scenario, detector)
    words, given = _words("trace", scenario)
    options = {"point": point, "trial": trial, "angle": angle, "method": method, "motor": motor, "errors": errors}
    options |= {"rotor": rotor, "seed": seed, "verify": verify, "format": format, "force": force}
    words += ["--out", os.fspath("." if out is None else out), *_options(options)]
    _, text, tables = _standstill.command(words, given, out is not None, None, made)
    return Trace(dict[str, Table](tables), json.loads(text))


def compare(
    scenario: Source | None = None,
    /,
    *,
    motor: str | None = None,
    method: Sequence[MethodName] | MethodName | None = None,
    errors: Sequence[ErrorSet] | ErrorSet | None = None,
    rotor: Sequence[Rotor] | Rotor | None = None,
    trials: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    threads: int | None = None,
    progress: Progress = None,
) -> list[dict[str, Any]]:
    """All methods on one motor, a dictionary for each, with the limit that physics sets; ``detector`` is compared with them.

    >>> import standstill as st
    >>> rows = st.compare(method=["bipolar", "maximum-likelihood"], errors="default", rotor="locked", trials=30)
    >>> [row["method"] for row in rows], rows[1]["rms_deg"] < rows[0]["rms_deg"]
    (['bipolar', 'maximum-likelihood'], True)
    """
    lists = {"method": method, "errors": errors, "rotor": rotor}
    joined = {name: value if value is None or isinstance(value, str) else ",".join(value) for name, value in lists.items()}
    options = {"motor": motor, **joined, "trials": trials, "seed": seed, "threads": threads}
    answer: list[dict[str, Any]] = _answer("compare", scenario, progress, detector, **options)
    return answer


def check(
    motor: Source,
    /,
    *,
    errors: ErrorSet | None = None,
    tolerance: float | None = None,
    movement: float | None = None,
    seed: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """Whether a motor, or a scenario's, is suited to detection at standstill, and by which method.

    >>> import standstill as st
    >>> st.check("paper-5k5")["suited"]
    True
    """
    options = {"errors": errors, "tolerance": tolerance, "movement": movement, "seed": seed}
    answer: dict[str, Any] = _answer("check", motor, progress, **options)
    return answer


def magnetics(
    motor: Pathlike,
    /,
    *,
    pole_pairs: int | None = None,
    resistance: float | None = None,
    values: str | None = None,
    columns: str | None = None,
    current: float | None = None,
    winding_temperature: float | None = None,
    magnet_temperature: float | None = None,
) -> dict[str, Any]:
    """A motor's or a flux map's inductances over current, and which pole draws more of it.

    >>> import standstill as st
    >>> st.magnetics("pm-reluctance")["polarity_signature"]
    'inverted'
    """
    options = {"pole_pairs": pole_pairs, "resistance": resistance, "values": values, "columns": columns}
    options |= {"current": current, "winding_temperature": winding_temperature, "magnet_temperature": magnet_temperature}
    answer: dict[str, Any] = _answer("magnetics", motor, **options)
    return answer


def bounds(
    scenario: Source | None = None,
    /,
    *,
    angles: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    threads: int | None = None,
) -> dict[str, Any]:
    """What no method can do better with the same pulses: the Cramér–Rao limit over the rotor's angle.

    >>> import standstill as st
    >>> limit = st.bounds('[detector]\\nmethod = "bipolar"', angles=4)
    >>> len(limit["angles"]), 0.0 < limit["rms"]["all_deg"] <= limit["rms"]["scheme_deg"]
    (4, True)
    """
    answer: dict[str, Any] = _answer("bounds", scenario, None, detector, angles=angles, seed=seed, threads=threads)
    return answer


def motors(name: str | None = None, /) -> dict[str, Any]:
    """The built-in motors and what they are; of one, or of a data sheet, each number and where it comes from.

    >>> import standstill as st
    >>> "paper-5k5" in st.motors(), st.motors("paper-5k5")["entries"][0]["key"]
    (True, 'rating.power')
    """
    answer: dict[str, Any] = json.loads(_standstill.command(["motors", "--json", *([] if name is None else [name])])[1])
    return answer


def fit(
    traces: Iterable[Pathlike] | Pathlike,
    /,
    *,
    motor: str | None = None,
    set: Mapping[str, Any] | None = None,
    out: Pathlike,
    force: bool = False,
    progress: Progress = None,
) -> dict[str, Any]:
    """A motor from scope traces of pulses at standstill; its data sheet is written to the folder ``out``.

    The columns are those of an oscilloscope: time, currents, DC link, and what each leg does (``docs/own-motor.md``).

    >>> import standstill as st
    >>> st.fit("scope.csv", out="fitted")
    Traceback (most recent call last):
    ...
    standstill.Error: cannot read scope.csv: No such file or directory (os error 2)
    """
    words = ["fit", "--json", *_paths(traces)]
    words += _options({"motor": motor, "set": set, "out": out, "force": force})
    answer: dict[str, Any] = json.loads(_standstill.command(words, None, True, progress)[1])
    return answer


def faults(
    scenario: Source,
    /,
    *,
    mode: FaultMode | Sequence[FaultMode] | None = None,
    method: MethodName | Sequence[MethodName] | None = None,
    trials: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """What each failure mode of drive, sensors and motor leads to: wrong poles, and whether the method detects it.

    >>> import standstill as st
    >>> answer = st.faults('[detector]\\nmethod = "bipolar"', mode="phase-open", trials=20)
    >>> answer["rows"][1]["effect"]
    'no start'
    """
    answer: dict[str, Any] = _answer(
        "faults", scenario, progress, detector, mode=mode, method=method, trials=trials, seed=seed, out=out, force=force, threads=threads
    )
    return answer


def qualify(
    scenario: Source,
    requirements: Pathlike,
    /,
    *,
    only: str | Sequence[str] | None = None,
    witness: bool = True,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """Whether a list of requirements is met, each passed, failed or not shown, with the evidence for an assessor.

    >>> import standstill as st
    >>> st.qualify('[detector]\\nmethod = "bipolar"', "none.toml")
    Traceback (most recent call last):
    ...
    standstill.Error: cannot read none.toml: No such file or directory (os error 2)
    """
    options = {"only": only, "no_witness": not witness, "seed": seed, "out": out, "force": force, "threads": threads}
    answer: dict[str, Any] = _answer("qualify", scenario, progress, detector, [os.fspath(requirements)], **options)
    return answer


def witness(*, progress: Progress = None) -> dict[str, Any]:
    """Closed forms, conservation laws and kept results, computed anew on this machine: some seconds."""
    answer: dict[str, Any] = _answer("witness", None, progress)
    return answer


def budget(
    scenario: Source,
    /,
    *,
    pairs: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """Where the error comes from: the share of each sensor and drive error and of each tolerance.

    >>> import standstill as st
    >>> answer = st.budget('[detector]\\nmethod = "bipolar"', pairs=100)
    >>> answer["method"]
    'bipolar'
    """
    answer: dict[str, Any] = _answer("budget", scenario, progress, detector, pairs=pairs, seed=seed, out=out, force=force, threads=threads)
    return answer


def require(
    scenario: Source,
    /,
    *,
    key: str | Sequence[str],
    limit: str,
    between: str | Sequence[str] | None = None,
    most: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """What a part must do: the largest or smallest value of a key with which limits such as "rms <= 1 deg" hold.

    >>> import standstill as st
    >>> text = '[detector]\\nmethod = "line-inductance-fast"'
    >>> answer = st.require(text, key="sensors.gain_error", limit="rms <= 2 deg", most=2000)
    >>> answer["answer"], answer["value"] < answer["high"] < 0.1
    ('at most', True)
    """
    options = {"key": key, "limit": limit, "between": between, "most": most, "seed": seed, "out": out, "force": force}
    answer: dict[str, Any] = _answer("require", scenario, progress, detector, **options, threads=threads)
    return answer


def odds(
    scenario: Source,
    /,
    *,
    event: str,
    effort: Effort | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """The probability of a rare event such as "wrong-pole" or "|e| > 3 deg", down to one in a billion.

    >>> import standstill as st
    >>> answer = st.odds('[detector]\\nmethod = "bipolar"', event="|e| > 0.2 deg")
    >>> 0.0 < answer["low"] <= answer["probability"] <= answer["high"] < 0.5
    True
    """
    answer: dict[str, Any] = _answer("odds", scenario, progress, detector, event=event, effort=effort, seed=seed, out=out, force=force, threads=threads)
    return answer


def tune(
    scenario: Source,
    /,
    *,
    vary: Mapping[str, str],
    minimise: str,
    subject_to: str | None = None,
    against: str | None = None,
    trials: int | None = None,
    starts: int | None = None,
    seed: int | None = None,
    detector: Detectors = None,
    out: Pathlike | None = None,
    force: bool = False,
    threads: int | None = None,
    progress: Progress = None,
) -> dict[str, Any]:
    """Which settings are best: a measure such as "rms" as small as can be while limits such as "moved <= 0.1 deg" hold.

    >>> import standstill as st
    >>> answer = st.tune('[detector]\\nmethod = "bipolar"', vary={"detector.pulse": "40us:80us"}, minimise="rms", trials=1000, starts=1)
    >>> answer["trials"], len(answer["front"]) >= 1
    (1000, True)
    """
    options: dict[str, Any] = {"vary": vary, "minimise": minimise, "subject_to": subject_to, "against": against, "trials": trials}
    options |= {"starts": starts, "seed": seed, "out": out, "force": force, "threads": threads}
    answer: dict[str, Any] = _answer("tune", scenario, progress, detector, **options)
    return answer


def explain(
    folder: Pathlike,
    /,
    *,
    trial: int | None = None,
    worst: int | None = None,
    wrong_poles: bool = False,
    point: int | None = None,
    files: Pathlike | None = None,
    detector: Callable[..., Detector] | None = None,
    out: Pathlike | None = None,
    force: bool = False,
    progress: Progress = None,
) -> dict[str, Any]:
    """Why trials of a finished run ended as they did: what they drew, and each again without one of its errors.
    A run of a class is repeated with the same class as ``detector``.

    >>> import standstill as st, tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     results = st.run('[detector]\\nmethod = "bipolar"', trials=100, out=folder)
    ...     answer = st.explain(folder)
    >>> answer["trials"][0]["trial"] == int(results["trial"][abs(results["axis_error_deg"]).argmax()])
    True
    """
    options = {"trial": trial, "worst": worst, "wrong_poles": wrong_poles, "point": point, "files": files, "out": out, "force": force}
    words = ["explain", "--json", os.fspath(folder), *_options(options)]
    made: _Class = None if detector is None else (detector, _digest.name(detector), takes(detector))
    answer: dict[str, Any] = json.loads(_standstill.command(words, None, out is not None, progress, made)[1])
    return answer
