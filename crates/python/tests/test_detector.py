"""Detectors written in Python."""

import math
import time

import numpy as np
import pytest

import standstill as st

OFF = ("off", "off", "off")
PULSE, REST = 80e-6, 600e-6
LINES = [("high", "low", "off"), ("off", "high", "low"), ("low", "off", "high")]


class Lines:
    """The paper's axis: equations (5) to (7) from the currents at the ends of three line pulses."""

    def __init__(self):
        self.inductances = []

    def step(self, readings):
        if len(self.inductances) < len(LINES) and len(readings):
            t, a, b, c, link, clipped = readings[-1]
            assert t == pytest.approx(PULSE - 1e-6) and clipped == 0.0
            current = (a, b, c)[len(self.inductances)]
            self.inductances.append(link * t / current)
        if len(self.inductances) < len(LINES):
            stages = [st.Stage(LINES[len(self.inductances)], PULSE), st.Stage(OFF, REST)]
            return st.Drive(stages, first=PULSE - 1e-6)
        ab, bc, ca = self.inductances
        # L_bc = c + s cos 2θ, L_ab = c + s cos(2θ − 120°), L_ca = c + s cos(2θ + 120°), with s > 0 where L_d < L_q.
        x = (2.0 * bc - ab - ca) / 3.0
        y = (ab - ca) / math.sqrt(3.0)
        return st.Axis(math.degrees(math.atan2(y, x)) / 2.0 % 180.0, "poles were not asked for")


def test_law_a_detector_in_python_finds_the_axis():
    results = st.run("trials = 40", detector=Lines)
    assert set(results["outcome"]) == {"undetermined"} and set(results["reason"]) == {"poles were not asked for"}
    assert np.abs(results["axis_error_deg"]).max() < 8.0, results["axis_error_deg"]
    assert results.summary["rms_deg"]["value"] < 3.0
    assert results.summary["reasons"]["poles were not asked for"]["count"] == 40


def test_law_the_same_trials_on_any_number_of_threads():
    one = st.run("trials = 60", detector=Lines, threads=1)
    two = st.run("trials = 60", detector=Lines, threads=2)
    assert one.summary == two.summary and (one["axis_error_deg"] == two["axis_error_deg"]).all()
    other = st.run("trials = 60", detector=Lines, seed=9)
    assert (one["axis_error_deg"] != other["axis_error_deg"]).all()


def test_law_what_it_raises_comes_out_with_the_trial():
    class Own(Exception):
        pass

    made = [0]

    class Raises(Lines):
        def __init__(self):
            super().__init__()
            made[0] += 1
            self.number = made[0]

        def step(self, readings):
            if self.number == 8:
                raise Own("no idea")
            return super().step(readings)

    with pytest.raises(Own, match="no idea") as error:
        st.run("trials = 40", detector=Raises, threads=1)
    assert error.value.trial == 7


@pytest.mark.parametrize(
    ("answer", "raised", "text"),
    [
        (lambda: 3, TypeError, "step returned 3: needed Drive, Found, Axis or Failed"),
        (lambda: st.Found(math.nan), ValueError, "an angle of NaN"),
        (lambda: st.Drive([]), ValueError, "a command without a stage"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)] * 3), ValueError, "a command of 3 stages"),
        (lambda: st.Drive([st.Stage(("on", "off", "off"), 1e-3)]), ValueError, "a leg of 'on': needed"),
        (lambda: st.Drive([st.Stage((1.5, 0.0, 0.0), 1e-3)]), ValueError, "a leg of 1.5: needed"),
        (lambda: st.Drive([st.Stage(OFF, -1e-3)]), ValueError, "a duration of -0.001 s"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)], first=2e-3), ValueError, "a sample at 0.002 s"),
        (lambda: st.Drive([st.Stage(OFF, 0.0)]), ValueError, "a command of no duration"),
    ],
)
def test_law_nonsense_is_refused_by_name(answer, raised, text):
    class Nonsense:
        def step(self, readings):
            return answer()

    with pytest.raises(raised) as error:
        st.run("trials = 3", detector=Nonsense)
    assert text in str(error.value), error.value
    assert error.value.trial == 0


def test_law_what_has_no_use_for_a_detector_is_refused(tmp_path):
    with pytest.raises(st.Error, match="in memory alone"):
        st.run("trials = 3", detector=Lines, out=tmp_path)
    with pytest.raises(st.Error, match="`trials`: found 0"):
        st.run("trials = 0", detector=Lines)
    failed = st.run("trials = 3", detector=lambda: type("No", (), {"step": lambda self, readings: st.Failed("broken")})())
    assert failed.summary["failed"] == 3 and set(failed["reason"]) == {"broken"}


def test_law_what_is_no_detector_is_named(tmp_path):
    class Stepless:
        pass

    with pytest.raises(TypeError, match="needed a class whose objects have `step`, or the path of a library"):
        st.run("trials = 3", detector=Lines())
    with pytest.raises(AttributeError, match="step") as error:
        st.run("trials = 3", detector=Stepless)
    assert error.value.trial == 0
    # A class that cannot be made into an object, in a trial of many.
    with pytest.raises(ZeroDivisionError) as error:
        st.run("trials = 3", detector=lambda: 1 / 0)
    assert error.value.trial == 0
    (tmp_path / "of.so").write_text("text")
    with pytest.raises(st.Error, match="no library: the file does not begin as one"):
        st.run("trials = 3", detector=tmp_path / "of.so")
    with pytest.raises(st.Error, match="nowhere.so"):
        st.run("trials = 3", detector="nowhere.so")


def test_law_a_step_that_ends_the_program_or_is_interrupted_leaves_no_thread_behind():
    class Quits:
        def step(self, readings):
            raise SystemExit(3)

    with pytest.raises(SystemExit) as error:
        st.run("trials = 300", detector=Quits, threads=2)
    assert error.value.code == 3
    # The interpreter is free: the next run is as any other.
    assert st.run("trials = 40", detector=Lines).summary["undetermined"] == 40


def test_law_axes_and_tolerances_hold_for_it_too():
    text = """
    trials = 10
    [axes]
    "sensors.noise" = ["1 mA", "100 mA"]
    [tolerances]
    "motor.winding.resistance" = { normal = "5 %" }
    """
    results = st.run(text, detector=Lines)
    assert [point["summary"]["trials"] for point in results.points] == [10, 10]
    assert (results["axis_error_deg"][:10] != results["axis_error_deg"][10:]).all()


class Idle:
    """Many short commands without current: the interpreter's share of a step."""

    def __init__(self):
        self.left = 400

    def step(self, readings):
        self.left -= 1
        if self.left:
            return st.Drive([st.Stage(OFF, 1e-4)], first=5e-5)
        return st.Failed("done")


def test_law_a_step_costs_little():
    def seconds(trials):
        begun = time.process_time()
        st.run(f"trials = {trials}", detector=Idle, threads=1, progress=False)
        return time.process_time() - begun

    few, many = seconds(2), min(seconds(52) for _ in range(3))
    step = (many - few) / 50 / 400
    # With what the plant costs in between, which without current is little; the bound leaves room for a busy machine.
    print(f"{step * 1e6:.1f} µs a step")
    assert step < 50e-6, step
