"""Types: those of the program's own lists, and what mypy makes of them."""

import importlib.util
import inspect
import os
import subprocess
import sys
import typing
from collections.abc import Callable
from pathlib import Path

import pytest

import standstill as st
from standstill import _standstill

PROGRAM = os.environ["STANDSTILL"]
HERE = Path(__file__).resolve().parents[1]
COMMANDS = [getattr(st, name) for name in st.__all__ if inspect.isfunction(getattr(st, name)) and name != "scenario"]


def test_golden_types_are_those_of_the_program() -> None:
    """STANDSTILL_WRITE=1 writes them anew."""
    script = HERE / "scripts/write_types.py"
    spec = importlib.util.spec_from_file_location("write_types", script)
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if os.environ.get("STANDSTILL_WRITE"):
        subprocess.run([sys.executable, str(script), PROGRAM], check=True)
    for name, text in module.texts(PROGRAM).items():
        assert (HERE / "standstill" / name).read_text() == text, f"{name}: STANDSTILL_WRITE=1 writes it anew"


def literals(annotation: object) -> set[str]:
    """The texts of all `Literal`s in an annotation."""
    if typing.get_origin(annotation) is typing.Literal:
        return set(typing.get_args(annotation))
    return {text for part in typing.get_args(annotation) for text in literals(part)}


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.__name__)
def test_law_choices_of_keywords_are_those_of_options(command: Callable[..., object]) -> None:
    types = typing.get_type_hints(command)
    keywords = [of.name for of in inspect.signature(command).parameters.values() if of.kind is of.KEYWORD_ONLY]
    for name in keywords:
        choices = _standstill.choices("run" if command is st.shard else command.__name__, name.replace("_", "-"))
        # Whether a flag is set needs no list.
        assert literals(types[name]) == set(choices), name


RIGHT = """
import numpy as np
import standstill as st

class Own:
    def step(self, readings: "np.typing.NDArray[np.float64]", /) -> st.Drive | st.Failed:
        return st.Failed("seen")

scenario: st.ScenarioDict = {"trials": 3, "rotor": {"state": "free"}, "sensors": {"noise": "20 mA"}, "axes": {"errors": ["none"]}}
results = st.run(scenario, detector=Own, format="parquet", rows="all")
results["trial"].mean()
"""


@pytest.mark.parametrize(
    ("right", "wrong", "error"),
    [
        ("", "", None),
        ("def step", "def stop", "arg-type"),
        ("-> st.Drive | st.Failed:", "-> int:", "arg-type"),
        ('return st.Failed("seen")', "return 3", "return-value"),
        ('format="parquet"', 'format="xls"', "arg-type"),
        ('rows="all"', 'rows="some"', "arg-type"),
        ('"state": "free"', '"state": "loose"', "typeddict-item"),
        ('"noise"', '"nose"', "typeddict-unknown-key"),
        ('"trials": 3', '"trials": []', "typeddict-item"),
    ],
)
def test_law_mypy_finds_what_is_wrong(right: str, wrong: str, error: str | None, tmp_path: Path) -> None:
    # A name of its own: in the common cache, a file of the same name, size and second counts as unchanged.
    own = tmp_path / f"own_{tmp_path.name}.py"
    own.write_text(RIGHT.replace(right, wrong) if right else RIGHT)

    words = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path.parent / "mypy"), own.name]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == (0 if error is None else 1) and (error is None or f"[{error}]" in done.stdout), done.stdout


def test_law_the_reference_has_each_name_once() -> None:
    done = subprocess.run([sys.executable, str(HERE / "scripts/write_reference.py")], capture_output=True, text=True, check=True)
    names = [line.removeprefix("### ") for line in done.stdout.splitlines() if line.startswith("### ")]
    assert sorted(names) == sorted(name for name in st.__all__ if name != "__version__")
    for command in COMMANDS:
        entry = done.stdout.split(f"### {command.__name__}\n")[1].split("\n### ")[0]
        assert all(f"{name}:" in entry for name in inspect.signature(command).parameters), entry
        assert " ".join((inspect.getdoc(command) or "nothing").split()[:4]) in " ".join(entry.split())
