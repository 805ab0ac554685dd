"""What a detector written in Python returns."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
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
    #: Time in s from the instant for which the angle holds to the end of the detection, if it is known. The table has the error at both.
    age: float | None = None


@dataclass(frozen=True)
class Axis:
    """The rotor's axis in electrical degrees; which of its ends is north is not known, and why.

    ``evidence``, ``needed`` and ``age`` as of :class:`Found`; negative evidence speaks for the other end.
    """

    angle: float
    reason: str = "undetermined"
    evidence: float | None = None
    needed: float | None = None
    age: float | None = None


@dataclass(frozen=True)
class Failed:
    """No angle, and why."""

    reason: str


@dataclass(frozen=True)
class Nameplate:
    """What the drive knows of the motor and of itself, as ``sts_drive`` of ``standstill.h`` has it: SI units."""

    #: Nominal voltage of the DC link in V.
    dc_link: float
    #: Rated current of a phase in A, peak.
    rated_current: float
    #: Resistance of a phase in ohm.
    resistance: float
    #: Inductances in H, without current.
    ld: float
    lq: float
    #: Flux linkage of the magnet in Wb; 0 without magnet.
    flux: float
    #: Near rated current, 1: the north pole draws the larger current, -1: the south pole, 0: neither.
    stronger_pole: int
    #: Dead time in s.
    dead_time: float
    #: Period of the PWM's carrier in s.
    period: float
    #: After a request to a leg, how long shunts are not read, in s; 0: not at all.
    settle: float
    #: Resolution of the current converters, also of that of a shunt in the DC link; 0: they do not round.
    current_bits: int
    #: A current is ``amps_at_zero`` + count * ``amps_per_count``; a count is the sum of all conversions of a sample.
    amps_per_count: float
    amps_at_zero: float
    #: Resolution of the DC link's converter, and its step in V.
    dc_link_bits: int
    volts_per_count: float
    #: Resolution of the converters behind the terminals' dividers, and their step in V; 0: there are none.
    terminal_bits: int
    terminal_volts_per_count: float
    #: Tick of the timer that captures trips of comparators, in s; 0: there is none, and no ``Drive.until``.
    timer_tick: float
    #: 0: none, 1: one comparator for the current in the DC link, 6: two for each leg, one a direction.
    comparators: int
    #: From the threshold to the captured time, and its standard deviation, in s.
    comparator_delay: float
    comparator_delay_spread: float
    #: Standard deviation of a comparator's offset, and noise of its current (rms), in A.
    comparator_offset: float
    comparator_noise: float
    #: After the begin of each stage, how long comparators are ignored, in s.
    comparator_blanking: float
    #: The highest ``Drive.until`` in A; 0: any.
    threshold_highest: float


#: Arguments of a detector's class that are given to it, if it has them.
GIVEN = ("drive", "config", "seed")


def takes(make: Callable[..., object]) -> list[str]:
    """Which of :data:`GIVEN` a class, or another maker of detectors, has as arguments."""
    try:
        arguments = inspect.signature(make).parameters.values()
    except (TypeError, ValueError):
        return []
    if any(argument.kind is argument.VAR_KEYWORD for argument in arguments):
        return list(GIVEN)
    named = {argument.name for argument in arguments if argument.kind not in (argument.POSITIONAL_ONLY, argument.VAR_POSITIONAL)}
    return [name for name in GIVEN if name in named]


class Detector(Protocol):
    """A detector: what an object of a class has. Each trial gets an object of its own.

    The class is made with those of these arguments that its ``__init__`` has: ``drive``, a :class:`Nameplate`; ``config``, a dictionary of the
    scenario's ``detector.config``; ``seed``, a whole number of 64 bits that each trial draws.

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


