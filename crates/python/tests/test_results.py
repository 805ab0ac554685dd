"""Results as columns: the bytes of the files, and the memory of NumPy, pandas, polars and Arrow."""

import copy
import inspect
import json
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

import standstill as st
from standstill import _standstill

PROGRAM = os.environ["STANDSTILL"]
SWEEP = """
trials = 60
[detector]
method = "line-inductance-fast"
[axes]
"sensors.noise" = { from = "10 mA", to = "400 mA", points = 2 }
"errors" = ["default", "harsh"]
"""


def command_line(*words: str, cwd: Path) -> str:
    done = subprocess.run([PROGRAM, *words], cwd=cwd, capture_output=True, text=True)
    assert done.returncode in (0, 1), done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def results() -> st.Results:
    return st.run(SWEEP)


def test_law_files_from_python_have_the_bytes_of_the_command_line(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SWEEP)
    for format in ("csv", "parquet", "npz", "mat"):
        command_line("run", "s.toml", "--format", format, "--out", f"a-{format}", cwd=tmp_path)
        results = st.run(tmp_path / "s.toml", out=tmp_path / f"b-{format}", format=format)
        for name in (f"trials.{format}", "summary.json"):
            assert (tmp_path / f"a-{format}" / name).read_bytes() == (tmp_path / f"b-{format}" / name).read_bytes(), name
        assert sorted(path.name for path in results.folder.iterdir()) == ["summary.json", f"trials.{format}"]
        # With axes whose points were chosen, statistics are those of each point.
        assert json.loads((tmp_path / f"a-{format}" / "summary.json").read_text())["points"] == results.points
        assert len(results.points) == 4 and results.summary == {}


def test_law_a_page_shows_its_charts_as_they_are_drawn(tmp_path: Path) -> None:
    """The next commands name the scenario's file, which is `scenario.toml` from Python."""
    budget = 'detector.method = "line-inductance-fast"\n'
    st.budget(budget, pairs=100, out=tmp_path / "b", progress=False)
    (tmp_path / "scenario.toml").write_text(budget)
    command_line("budget", "scenario.toml", "--pairs", "100", "--out", "a", cwd=tmp_path)
    a, b = ((tmp_path / of / "budget.html").read_text() for of in "ab")
    assert len(a) > 1_500_000 > 500_000 > len(b), (len(a), len(b))
    # Each chart has its drawing, which is what paper and readers without scripts see too.
    drawn = '<div class="drawn" role="img"'
    assert a.count(drawn) == b.count(drawn) > 0
    for name in ("budget.csv", "budget.json", "budget.svg", "budget.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_law_columns_are_those_of_the_files(results: st.Results, tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text(SWEEP)
    for format in ("csv", "parquet", "npz", "mat"):
        command_line("run", "s.toml", "--format", format, "--out", format, cwd=tmp_path)
    text = pd.read_csv(tmp_path / "csv/trials.csv").drop(columns="run")
    binary = pq.read_table(tmp_path / "parquet/trials.parquet")
    archive = np.load(tmp_path / "npz/trials.npz")
    matlab = scipy.io.loadmat(tmp_path / "mat/trials.mat", squeeze_me=True, chars_as_strings=True)
    assert list(results) == list(text.columns) == binary.column_names == [name for name in archive if name != "run"]
    assert json.loads(str(archive["run"]))["seed"] == json.loads(str(matlab["run"]))["seed"] == "1"
    frame = pl.DataFrame(results)
    assert frame.equals(pl.read_parquet(tmp_path / "parquet/trials.parquet"))
    assert pa.table(results).to_pydict() == binary.to_pydict()
    assert results["pole_correct"].dtype == bool and len(results) == len(text.columns)
    assert results.rows == len(text) == 240 and results["error_deg"].mask.sum() == text["error_deg"].isna().sum() > 0
    for name, column in results.items():
        of_matlab = matlab[name.replace(".", "_")]
        if column.dtype == object:
            texts = list(np.ma.getdata(column))
            assert texts == list(text[name].fillna("")) == list(archive[name]), name
            assert [cell.rstrip() for cell in of_matlab] == texts, name
        else:
            # In files of arrays, an empty flag is no number.
            numbers = np.ma.filled(column.astype(float), np.nan)
            np.testing.assert_array_equal(numbers, text[name].astype(float), err_msg=name)
            np.testing.assert_array_equal(numbers, archive[name])
            np.testing.assert_array_equal(numbers, of_matlab)


def test_law_nothing_is_copied(results: st.Results) -> None:
    column = results["true_angle_deg"]
    address = column.__array_interface__["data"][0]
    assert not column.flags.writeable and results["true_angle_deg"] is column
    with pytest.raises(ValueError, match="read-only"):
        column[0] = 1.0
    frame = pd.DataFrame({name: results[name] for name in ("trial", "true_angle_deg")}, copy=False)
    assert np.shares_memory(frame["true_angle_deg"].to_numpy(), column)
    assert pa.table(results)["true_angle_deg"].chunk(0).buffers()[1].address == address
    of_polars = pl.DataFrame(results)["true_angle_deg"].to_numpy(allow_copy=False)
    assert of_polars.__array_interface__["data"][0] == address
    # The arrays outlive what they came from.
    table = st.run('trials = 10\n[detector]\nmethod = "bipolar"')
    errors = table["axis_error_deg"]
    before = errors.copy()
    arrow = pa.table(table)["axis_error_deg"]
    del table
    st.run('trials = 10\nseed = 2\n[detector]\nmethod = "bipolar"')
    assert (errors == before).all() and arrow.to_pylist() == before.tolist()


def test_law_results_go_through_pickles_and_copies_as_they_are(results: st.Results, tmp_path: Path) -> None:
    for twin in (pickle.loads(pickle.dumps(results)), copy.copy(results), copy.deepcopy(results)):
        assert type(twin) is st.Results and twin.rows == results.rows and list(twin) == list(results)
        assert twin == results and not twin != results and twin is not results
        assert (twin.run, twin.summary, twin.points, twin.folder) == (results.run, results.summary, results.points, results.folder)
        assert twin.run["numerics"] and twin.run["scenario"]
        assert pl.DataFrame(twin).equals(pl.DataFrame(results)) and pa.table(twin).equals(pa.table(results))
        for name, column in results.items():
            assert type(twin[name]) is type(column) and twin[name].dtype == column.dtype and not twin[name].flags.writeable
            assert (np.ma.getmaskarray(twin[name]) == np.ma.getmaskarray(column)).all() and (twin[name] == column).all(), name
    without = st.run(SWEEP, rows="none")
    assert pickle.loads(pickle.dumps(without)) == without != results and len(without) == without.rows == 0
    trace = st.trace(method="bipolar", angle=40.0)
    assert pickle.loads(pickle.dumps(trace)).waveform == trace.waveform != trace.events
    table, parts = results._table, results._table.parts()
    for damaged in (
        (parts[0] + 1, parts[1]),
        (parts[0], [(name, "whole", b"", b"123") for name, *_ in parts[1]]),
        (parts[0], [(name, "other", offsets, values) for name, _, offsets, values in parts[1]]),
        (parts[0], [(name, "text", b"\xff" * 8 * (parts[0] + 1), b"") for name, *_ in parts[1]]),
    ):
        with pytest.raises(ValueError, match="damaged"):
            type(table).of_parts(*damaged)


def test_law_results_come_back_from_pools_of_processes(results: st.Results) -> None:
    """Dask's workers return what `pickle` makes of it, as these do."""
    with ProcessPoolExecutor(1, mp_context=multiprocessing.get_context("spawn")) as pool:
        assert pool.submit(st.run, SWEEP).result() == results


def test_law_results_are_a_mapping_that_nobody_changes(results: st.Results) -> None:
    assert isinstance(results, Mapping) and len(results) == len(list(results)) == len(dict(results)) > 10
    assert results.get("nothing") is None and list(results.keys()) == list(results) == list(dict(results)) == list({**results})
    assert results == st.run(SWEEP) != st.run(SWEEP, seed=2) and results != dict(results) and results != 3
    # One number of another bit.
    rows, columns = results._table.parts()
    cells = {name: values for name, _, _, values in columns}["true_angle_deg"]
    changed = [(*of[:3], bytes([cells[0] ^ 1]) + cells[1:]) if of[0] == "true_angle_deg" else of for of in columns]
    twin = copy.copy(results)
    twin._table = type(results._table).of_parts(rows, changed)
    assert twin != results
    for change in (
        lambda: results.__setitem__("trial", 0),
        lambda: results.pop("trial"),
        lambda: results.update({"trial": 0}),
        lambda: results.clear(),
    ):
        with pytest.raises(TypeError, match="cannot be changed"):
            change()
    with pytest.raises(ValueError, match="read-only"):
        results["error_deg"][0] = 1.0


def test_law_results_become_data_frames(results: st.Results) -> None:
    """By each constructor what it makes of Arrow's table, where empty cells are null and flags are flags."""
    arrow = results.to_arrow()
    expected = arrow.to_pydict()
    assert any(None in column for column in expected.values())
    assert pl.DataFrame(results).to_dict(as_series=False) == pl.from_arrow(arrow).to_dict(as_series=False) == expected
    assert pa.table(results).to_pydict() == expected
    assert pl.DataFrame(results).schema == pl.from_arrow(arrow).schema
    for frame in (pd.DataFrame(results), results.to_pandas()):
        assert list(frame.columns) == list(results) and len(frame) == results.rows == 240
        for name, column in expected.items():
            assert [None if pd.isna(cell) else cell for cell in frame[name]] == column, name
    types = results.to_pandas().dtypes
    assert (types["error_deg"], types["pole_correct"], types["reason"], types["trial"]) == ("Float64", "boolean", "string", "int64")
    empty = results.to_pandas()["pole_correct"].isna()
    assert 0 < empty.sum() < 240 and (empty == (results["outcome"] != "found")).all()
    assert np.shares_memory(results.to_pandas()["error_deg"].array._data, results["error_deg"])
    page = results._repr_html_()
    assert "points of the axes" in page and page.count("<tr>") > 6 and "trials" in repr(results)


def test_law_frames_carry_what_was_run(results: st.Results, tmp_path: Path) -> None:
    """The metadata of the file in Parquet."""
    st.run(SWEEP, out=tmp_path, format="parquet")
    stored = pq.read_schema(tmp_path / "trials.parquet").metadata
    stored = {key.decode(): value.decode() for key, value in stored.items() if key != b"ARROW:schema"}
    assert set(stored) == {"version", "numerics", "seed", "scenario"}
    assert results.to_pandas().attrs == results.to_pandas().head().attrs == stored == results.metadata
    assert {key.decode(): value.decode() for key, value in results.to_arrow().schema.metadata.items()} == stored
    assert pickle.loads(pickle.dumps(results)).metadata == stored
    events = st.trace(method="bipolar", angle=40.0).events.to_pandas().attrs
    assert events["numerics"] == stored["numerics"] and "bipolar" in events["scenario"]


def test_law_values_are_refused_with_those_that_there_are() -> None:
    with pytest.raises(ValueError, match="known: line-inductance"):
        st.run({"detector": {"method": "no such method"}})
    assert isinstance(st.run({"trials": 3, "detector": {"method": "bipolar"}}), st.Results)


def test_law_a_plot_shows_each_start_by_what_it_ended_as(results: st.Results) -> None:
    import matplotlib

    matplotlib.use("Agg")
    axes = results.plot()
    drawn = {line.get_label(): len(line.get_xdata()) for line in axes.lines}
    outcome, wrong = results["outcome"], np.ma.filled(results["pole_correct"] == 0, False)
    assert drawn == {
        "right pole": int(((outcome == "found") & ~wrong).sum()),
        "pole undetermined": int((outcome == "undetermined").sum()),
        "wrong pole": int(wrong.sum()),
    }
    assert "electrical degrees" in axes.get_xlabel() and results.plot(axes) is axes
    with pytest.raises(ValueError, match="no rows"):
        st.run(SWEEP, rows="none").plot()


def test_law_a_trace_has_the_columns_of_its_files(tmp_path: Path) -> None:
    trace = st.trace(method="bipolar", angle=40.0)
    for format in ("csv", "parquet", "npz", "mat"):
        words = ("trace", "--method", "bipolar", "--angle", "40", "--format", format, "--out", format)
        command_line(*words, cwd=tmp_path)
    assert json.loads((tmp_path / "csv/result.json").read_text()) == trace.result
    for name, table in (("waveform", trace.waveform), ("events", trace.events)):
        text = pd.read_csv(tmp_path / f"csv/{name}.csv")
        assert [*table, "run"] == list(text.columns) and table.rows == len(text)
        assert json.loads(text["run"][0])["scenario"] == trace.result["scenario"]
        assert pl.DataFrame(table).equals(pl.read_parquet(tmp_path / f"parquet/{name}.parquet"))
        archive = np.load(tmp_path / f"npz/{name}.npz")
        matlab = scipy.io.loadmat(tmp_path / f"mat/{name}.mat", squeeze_me=True)
        for column in table:
            if table[column].dtype == object:
                assert list(archive[column]) == list(np.ma.getdata(table[column])) == [cell.rstrip() for cell in matlab[column]]
            else:
                numbers = np.ma.filled(table[column].astype(float), np.nan)
                np.testing.assert_array_equal(archive[column], numbers)
                np.testing.assert_array_equal(matlab[column], numbers)
                # CSV has fixed digits.
                np.testing.assert_allclose(numbers, text[column], rtol=0, atol=1e-6)
    written = st.trace(method="bipolar", angle=40.0, out=tmp_path / "python")
    assert written.result == trace.result
    assert (tmp_path / "python/waveform.csv").read_bytes() == (tmp_path / "csv/waveform.csv").read_bytes()


def test_law_errors_have_the_text_of_the_command_line_in_keywords(tmp_path: Path) -> None:
    (tmp_path / "s.toml").write_text("trials = 10\n[sensors]\nnose = 1\n")
    (tmp_path / "taken").write_text("a file")
    (tmp_path / "scenario").write_text("trials = 10\n")
    (tmp_path / "empty").mkdir()
    (tmp_path / "drive.fmu").write_bytes(b"PK\x03\x04\xff")
    cases = [
        (["run", "s.toml"], lambda: st.run("s.toml")),
        (["run", "nowhere.toml"], lambda: st.run("nowhere.toml")),
        (["check", "nomotor"], lambda: st.check("nomotor")),
        (["motors", "nomotor"], lambda: st.motors("nomotor")),
        (["run", "s.toml", "--trials", "0", "--json"], lambda: st.run("s.toml", trials=0)),
        (["odds", "s.toml", "--event", "luck", "--json"], lambda: st.odds("s.toml", event="luck")),
        (["merge", "nowhere"], lambda: st.merge(["nowhere"])),
        (["merge", "s.toml"], lambda: st.merge("s.toml")),
        (["status", "s.toml"], lambda: st.status(["s.toml"])),
        (["run", "drive.fmu"], lambda: st.run("drive.fmu")),
        (["trace", "--out", "taken/x"], lambda: st.trace(out="taken/x")),
        (["sweep", "scenario"], lambda: st.sweep("scenario")),
        (["explain", "empty"], lambda: st.explain("empty")),
    ]
    before = os.getcwd()
    os.chdir(tmp_path)
    try:
        for words, call in cases:
            done = subprocess.run([PROGRAM, *words], capture_output=True, text=True)
            assert done.returncode == 2
            with pytest.raises(st.Error) as error:
                call()
            line = done.stderr.removeprefix("standstill: ").rstrip("\n")
            assert str(error.value) == _standstill.keywords(line) and "--" not in str(error.value)
    finally:
        os.chdir(before)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["drive.fmu", "empty", "s.toml", "scenario", "taken"]


COMMANDS = [getattr(st, name) for name in st.__all__ if inspect.isfunction(getattr(st, name)) and name != "scenario"]


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.__name__)
def test_law_messages_name_keywords_of_functions(command: Callable[..., object]) -> None:
    """Each option that a function has as a keyword is said by this keyword."""
    options = [of for of in inspect.signature(command).parameters.values() if of.kind is of.KEYWORD_ONLY and of.name != "progress"]
    said = _standstill.keywords
    for of in options:
        option = "--" + of.name.replace("_", "-")
        if of.name == "witness":
            assert said("or --no-witness to") == "or witness=False to"
        elif isinstance(of.default, bool):
            assert said(f"found b, needed {option} to go on") == f"found b, needed {of.name}=True to go on"
        else:
            assert said(f"another {option}, or") == f"another {of.name}, or"
            pair = said(f"needed {option} A=5") in (f'needed {of.name}={{"A": "5"}}', f'needed {of.name}="A=5"')
            assert said(f"needed {option} 5") == f"needed {of.name}=5" and pair
            assert ("Mapping" in str(of.annotation)) == ("{" in said(f"needed {option} A=5")), of
    if command is not st.shard:
        # The program has no such command, but an option of `run`.
        assert said(f"`standstill {command.__name__}` says") == f"`standstill.{command.__name__}` says"


def test_law_other_threads_run_meanwhile() -> None:
    counted = [0]
    stop = threading.Event()

    def count() -> None:
        while not stop.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    try:
        begun, before = time.perf_counter(), counted[0]
        st.run('trials = 3000\n[detector]\nmethod = "bipolar"', threads=1, progress=False)
        took, during = time.perf_counter() - begun, counted[0] - before
        before = counted[0]
        time.sleep(took)
        alone = counted[0] - before
    finally:
        stop.set()
        thread.join()
    # With the interpreter held, it would count only in the pauses between the looks for signals: not at all.
    assert during > 0.2 * alone > 0, (during, alone)


def test_law_progress_is_told_and_what_it_raises_ends_the_run() -> None:
    seen: list[tuple[int, int]] = []
    st.run('trials = 4000\n[detector]\nmethod = "bipolar"', progress=lambda done, of: seen.append((done, of)))
    trials = [done for done, of in seen if of == 4000]
    assert trials and trials == sorted(trials)

    def enough(done: int, of: int) -> None:
        raise RuntimeError("enough")

    begun = time.perf_counter()
    with pytest.raises(RuntimeError, match="enough"):
        st.run('trials = 4000000\n[detector]\nmethod = "bipolar"', progress=enough)
    assert time.perf_counter() - begun < 5.0
    # Nothing goes on computing behind it.
    time.sleep(1.0)
    before = time.process_time()
    time.sleep(1.0)
    assert time.process_time() - before < 0.3


def test_law_files_are_written_only_where_they_are_asked_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = '[detector]\nmethod = "bipolar"'
    st.run(text, trials=20)
    st.trace(text)
    st.odds(text, event="|e| > 0.2 deg", progress=False)
    st.compare(method="bipolar", errors="default", rotor="locked", trials=5)
    st.magnetics("paper-5k5")
    assert list(tmp_path.iterdir()) == []
    st.run(text, trials=20, out="run")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["run"]


def test_law_results_of_another_question_are_replaced_with_force_alone(tmp_path: Path) -> None:
    of = '[detector]\nmethod = "{}"'.format

    def run(method: str, **more: bool) -> object:
        return st.run(of(method), trials=50, out=tmp_path / "run", **more)

    def trace(method: str, **more: bool) -> object:
        return st.trace(of(method), trial=3, out=tmp_path / "trace", **more)

    def budget(method: str, **more: bool) -> object:
        return st.budget(of(method), pairs=100, out=tmp_path / "budget", **more)

    for carry_out in (run, trace, budget):
        carry_out("bipolar")
        with pytest.raises(st.Error, match=r"another out, or force=True to replace them"):
            carry_out("line-inductance-fast")
        carry_out("line-inductance-fast", force=True)


def test_law_a_run_goes_on_and_ends_early_as_by_the_command_line(tmp_path: Path) -> None:
    text = 'trials = 12000\n[detector]\nmethod = "bipolar"'

    def some(done: int, of: int) -> None:
        if 0 < done:
            raise RuntimeError("enough")

    with pytest.raises(RuntimeError):
        st.run(text, out=tmp_path / "a", progress=some)
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["run.journal"]
    with pytest.raises(st.Error, match="needed resume=True to go on with it, another out, or force=True"):
        st.run(text, out=tmp_path / "a")
    assert st.run(text, out=tmp_path / "a", resume=True).rows == 12_000
    st.run(text, out=tmp_path / "b")
    assert (tmp_path / "a/trials.csv").read_bytes() == (tmp_path / "b/trials.csv").read_bytes()
    early = st.run(text, stop_at={"rms": "5%"})
    assert 100 < early.summary["trials"] == early.rows < 12_000


def test_law_a_column_that_is_not_there_is_named(results: st.Results) -> None:
    with pytest.raises(KeyError, match="no column `angle`; there are sensors.noise, errors, trial"):
        results["angle"]
    assert "angle" not in results and "trial" in results


def test_law_a_trace_is_fitted_as_by_the_command_line(tmp_path: Path) -> None:
    trace = Path(__file__).parents[3] / "examples/traces/six_vectors.csv"
    said = json.loads(command_line("fit", str(trace), "--json", "--out", "a", cwd=tmp_path))
    answer = st.fit(trace, out=tmp_path / "b")
    assert answer["converged"] and answer["parameters"] == said["parameters"]
    # What each fitted is a motor.
    sheets = [sorted((tmp_path / of).glob("*.toml")) for of in "ab"]
    assert [sheet.read_text() for sheet in sheets[0]] == [sheet.read_text() for sheet in sheets[1]] != []


def test_law_failure_modes_are_those_of_the_command_line(tmp_path: Path) -> None:
    """An open wire leaves one line to measure: no start. A weak magnet changes no inductance: nothing is wrong, some poles may stay open."""
    scenario = '[detector]\nmethod = "bipolar"\n'
    (tmp_path / "scenario.toml").write_text(scenario)
    words = ["--mode", "phase-open", "--mode", "magnet-weak", "--method", "bipolar", "--trials", "30", "--out", "a", "--json"]
    said = json.loads(command_line("faults", "scenario.toml", *words, cwd=tmp_path))
    modes = ["phase-open", "magnet-weak"]
    answer = st.faults(
        scenario, mode=modes, method="bipolar", trials=30, out=tmp_path / "b"
    )
    assert answer["rows"] == said["rows"] and answer["demand"] == said["demand"]
    for name in ("faults.csv", "faults.json"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
    rows = pd.read_csv(tmp_path / "b" / "faults.csv")
    assert len(rows) == len(answer["rows"]) and set(rows["failure_mode"]) >= set(modes)
    for row in answer["rows"]:
        assert row["trials"] == 30 == row["right"] + row["wrong_pole"] + row["right_pole_beyond_limit"] + row["detected"] + row["errors"]
    effect = {row["failure_mode"]: row["effect"] for row in answer["rows"] if row["begins"] == "before"}
    assert effect["phase-open"] == "no start" and effect["magnet-weak"] in ("none (latent)", "no start in some")
    # A mode that is none is refused with those that are.
    with pytest.raises(st.Error, match="(?s)phase-opne.*phase-open"):
        st.faults(scenario, mode="phase-opne", trials=2)
    # Files of another question stay.
    with pytest.raises(st.Error, match="force=True"):
        st.faults(scenario, mode="phase-open", trials=31, out=tmp_path / "b")


INTERRUPTED = """
import os, signal, sys, threading, time
import standstill as st
def interrupt():
    time.sleep(1.0)
    global sent
    sent = time.perf_counter()
    os.kill(os.getpid(), signal.SIGINT)
threading.Thread(target=interrupt).start()
try:
    {call}
except KeyboardInterrupt:
    print(time.perf_counter() - sent)
"""


@pytest.mark.parametrize(
    "call",
    [
        "st.run('trials = 10000000\\n[detector]\\nmethod = \"bipolar\"', out=sys.argv[1])",
        "st.odds('[detector]\\nmethod = \"bipolar\"', event='|e| > 5 deg')",
        "st.bounds('[detector]\\nmethod = \"maximum-likelihood\"', angles=3600)",
    ],
)
def test_law_an_interrupt_ends_within_a_second(call: str, tmp_path: Path) -> None:
    words = [sys.executable, "-c", INTERRUPTED.format(call=call), str(tmp_path / "out")]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    assert float(done.stdout) < 1.0
    if "st.run" in call:
        # What was done is kept, and the command line goes on with it.
        assert [path.name for path in (tmp_path / "out").iterdir()] == ["run.journal"]


def test_law_without_rows_the_summary_is_the_same(results: st.Results) -> None:
    none = st.run(SWEEP, rows="none")
    assert none.summary == results.summary and none.points == results.points
    assert none.rows == len(none) == 0 and list(none) == []
    with pytest.raises(KeyError, match="no column"):
        none["trial"]


def test_law_a_key_by_any_way_is_the_same_scenario() -> None:
    text = '[detector]\nmethod = "bipolar"\n[sensors]\nnoise = "30 mA"\n'
    nested = st.scenario('[detector]\nmethod = "bipolar"', sensors={"noise": "30 mA"}, trials=20)
    dotted = st.scenario("", **{"detector.method": "bipolar", "sensors.noise": 0.03, "trials": 20})
    expected = st.run(text, trials=20)
    for scenario in (nested, dotted):
        assert (st.run(scenario)["axis_error_deg"] == expected["axis_error_deg"]).all()
    axes = st.scenario(text, axes={"sensors.noise": {"from": "1 mA", "to": "9 mA", "points": 2}}, trials=5)
    assert len(st.run(axes).points) == 2
    with pytest.raises(TypeError, match="no value of a scenario"):
        st.scenario(text, seed=object())
    # What is set last counts, and a scenario that others are made from stays as it is.
    base = st.scenario(text, trials=5)
    assert st.run(st.scenario(base, trials=7)).summary["trials"] == 7 and st.run(base).summary["trials"] == 5
    wide = st.scenario(base, tolerances={"motor.winding.resistance": {"normal": "20 %"}})
    assert st.run(wide).run["scenario"] != st.run(base).run["scenario"]


if __name__ == "__main__":
    sys.exit(pytest.main([__file__]))
