"""Standstill: a test bench for initial rotor position detection of permanent-magnet synchronous motors.

Functions are the commands of ``standstill`` by name, with their options as keywords; ``standstill COMMAND --help`` and the
pages in ``docs/`` describe them. Whatever is wrong raises :class:`Error` with the line that the command line prints.

Python's other threads run while Standstill does, and Ctrl-C raises ``KeyboardInterrupt`` within a second.

>>> import standstill as st
>>> results = st.run('trials = 100\\n[detector]\\nmethod = "bipolar"')
>>> results.summary["wrong_poles"]
0
>>> bool(abs(results["axis_error_deg"]).max() < 1.0)
True
"""

from ._commands import (
    bounds,
    budget,
    faults,
    qualify,
    witness,
    check,
    compare,
    explain,
    fit,
    magnetics,
    merge,
    motors,
    odds,
    require,
    run,
    shard,
    status,
    sweep,
    trace,
    tune,
)
from ._detector import Axis, Detector, Drive, Failed, Found, Nameplate, Stage
from ._results import Columns, Results, Trace
from ._scenario import Scenario, scenario
from ._standstill import Error, __version__
from ._types import ScenarioDict

__all__ = [
    "Axis",
    "Columns",
    "Detector",
    "Drive",
    "Error",
    "Failed",
    "Found",
    "Nameplate",
    "Results",
    "Scenario",
    "ScenarioDict",
    "Stage",
    "Trace",
    "__version__",
    "bounds",
    "budget",
    "faults",
    "qualify",
    "witness",
    "check",
    "compare",
    "explain",
    "fit",
    "magnetics",
    "merge",
    "motors",
    "odds",
    "require",
    "run",
    "scenario",
    "shard",
    "status",
    "sweep",
    "trace",
    "tune",
]
