"""What a detector written in Python returns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol, Union

import numpy as np
import numpy.typing as npt

#: What a leg is asked for: "off", "low", "high", or the share of each PWM period for which its upper switch is on.
Leg = Union[str, float]


@dataclass(frozen=True)
class Stage:
    """The legs' state for a while.

    >>> import standstill as st
    >>> pulse = st.Stage(("high", "low", "off"), 80e-6)
    """

    #: One for each phase.
    legs: tuple[Leg, Leg, Leg]
    #: How long it is held, in s.
    duration: float


@dataclass(frozen=True)
class Drive:
    """A command: one stage or two, and when the converters sample.

    >>> import standstill as st
    >>> pulse = st.Drive([st.Stage(("high", "low", "off"), 80e-6), st.Stage(("off", "off", "off"), 400e-6)], first=79e-6)
    """

    #: One after the other, two at most.
    stages: Sequence[Stage]
    #: The first sample, in s from the begin of the command.
    first: float = 0.0
    #: From one sample to the next, in s.
    interval: float = 0.0
    #: How many samples.
    count: int = 1
    #: A threshold in A: the first stage ends when a comparator of the drive trips there, at the latest after its duration. It
    #: needs a drive with a timer behind comparators (``sensors.timer``); its legs are "off", "low" or "high", and ``first``
    #: counts from its end. None: it lasts its duration.
    until: float | None = None


@dataclass(frozen=True)
class Found:
    """The north pole's electrical angle in degrees.

    What speaks for that pole may be told, in standard deviations: ``evidence``, and what the detector needs of it before it
    names a pole. The table has both for each trial.

    >>> import standstill as st
    >>> end = st.Found(42.0, evidence=6.5, needed=5.1)
    """

    angle: float
    evidence: float | None = None
    needed: float | None = None


@dataclass(frozen=True)
class Axis:
    """The rotor's axis in electrical degrees; which of its ends is north is not known, and why.

    ``evidence`` and ``needed`` as of :class:`Found`; negative evidence speaks for the other end.
    """

    angle: float
    reason: str = "undetermined"
    evidence: float | None = None
    needed: float | None = None


@dataclass(frozen=True)
class Failed:
    """No angle, and why."""

    reason: str


class Detector(Protocol):
    """A detector: a class without arguments, of which each trial gets an object of its own.

    ``step`` gets the readings of its last command, a row for each sample: time in s from the begin of the command (with
    ``until``, from the end of its first stage), the currents of phases a, b, c in A, the DC link in V, 1 where a current or the
    link was clipped by its converter, else 0, the current of a shunt in the DC link in A, the voltages of the three terminals in V, the
    ticks of the timer at which a comparator tripped, the comparator's leg (0 to 2), and 1 where a terminal was clipped. NaN stands for what no sensor sees and
    for a comparator that has not tripped. Later versions append columns. The first call gets none. It returns a :class:`Drive`, or how
    the detection ends: :class:`Found`, :class:`Axis` or :class:`Failed`.
    """

    def step(self, readings: npt.NDArray[np.float64], /) -> Drive | Found | Axis | Failed:
        """From the readings to the next step."""
        ...


