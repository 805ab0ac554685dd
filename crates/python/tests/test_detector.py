"""Detectors written in Python."""

import math
import sys
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
    if sys.version_info >= (3, 11):
        assert error.value.__notes__ == ["in trial 7"]


class Watches:
    """Gives one command and keeps what it reads."""

    def __init__(self, command, seen, end=st.Failed("seen")):
        self.command, self.seen, self.end, self.begun = command, seen, end, False

    def step(self, readings):
        if not self.begun:
            self.begun = True
            assert readings.shape == (0, 6)
            return self.command
        self.seen.append(readings.copy())
        return self.end


def readings(command, text=""):
    """What one command reads, in trial 0."""
    seen = []
    st.run(f"trials = 1\n{text}", detector=lambda: Watches(command, seen))
    return seen[0]


def test_law_samples_stand_where_they_were_asked_for():
    read = readings(st.Drive([st.Stage(LINES[0], PULSE), st.Stage(OFF, REST)], first=20e-6, interval=25e-6, count=3))
    assert read[:, 0] == pytest.approx([20e-6, 45e-6, 70e-6])
    a, b, c = read[:, 1], read[:, 2], read[:, 3]
    assert (np.diff(a) > 0.3).all() and (np.abs(a + b) < 0.2).all() and (np.abs(c) < 0.2).all()
    assert read[:, 4] == pytest.approx([550.0] * 3, rel=0.02) and (read[:, 5] == 0.0).all()


def test_law_a_second_stage_follows_the_first():
    one = readings(st.Drive([st.Stage(LINES[0], 2 * PULSE)], first=1.9 * PULSE))
    two = readings(st.Drive([st.Stage(LINES[0], PULSE), st.Stage(OFF, PULSE)], first=1.9 * PULSE))
    assert one[0, 1] > 2.0 and abs(two[0, 1]) < 0.5


def test_law_a_duty_is_the_share_of_the_upper_switch():
    of = {duty: readings(st.Drive([st.Stage((duty, 0.5, 0.5), 5e-4)], first=5e-4))[0, 1] for duty in (0.3, 0.5, 0.7)}
    assert of[0.3] < -1.0 and abs(of[0.5]) < 0.3 and 1.0 < of[0.7] < 8.0, of
    assert of[0.3] == pytest.approx(-of[0.7], rel=0.2)


def test_law_what_no_sensor_sees_is_nan_and_what_is_beyond_the_range_is_marked():
    up = st.Drive([st.Stage(("high", "low", "high"), PULSE), st.Stage(OFF, REST)], first=PULSE - 5e-6)
    read = readings(up, "[sensors]\narrangement = 'low-side-shunts'\n")[0]
    # Only the leg whose lower switch conducts has a current in its shunt.
    assert np.isnan(read[[1, 3]]).all() and read[2] < -1.0 and read[5] == 0.0
    pulse = st.Drive([st.Stage(LINES[0], PULSE), st.Stage(OFF, REST)], first=PULSE - 5e-6)
    read = readings(pulse, "[sensors]\nrange = '1 A'\n")[0]
    assert read[5] == 1.0 and read[1] == pytest.approx(1.0, abs=0.1) and not np.isnan(read[1:4]).any()


def test_law_an_angle_that_it_names_is_judged():
    def results(end):
        return st.run("trials = 4\nrotor.angle = 70", detector=lambda: Watches(st.Drive([st.Stage(OFF, 1e-3)]), [], end))

    right, wrong, axis = results(st.Found(71.0)), results(st.Found(251.0)), results(st.Axis(-109.0, "no pole"))
    assert set(right["outcome"]) == set(wrong["outcome"]) == {"found"} and set(axis["outcome"]) == {"undetermined"}
    assert right["error_deg"] == pytest.approx([1.0] * 4) and wrong["error_deg"] == pytest.approx([-179.0] * 4)
    assert all(of["axis_error_deg"] == pytest.approx([1.0] * 4) for of in (right, wrong, axis))
    assert [of.summary["wrong_poles"] for of in (right, wrong, axis)] == [0, 4, 0]
    assert (right["pole_correct"] == 1.0).all() and (wrong["pole_correct"] == 0.0).all()
    assert set(axis["reason"]) == {"no pole"} and set(right["reason"]) == {""}


def test_law_what_speaks_for_a_pole_stands_in_the_table():
    def results(end):
        return st.run("trials = 2", detector=lambda: Watches(st.Drive([st.Stage(OFF, 1e-3)]), [], end))

    found, axis = results(st.Found(71.0, evidence=6.5, needed=5.1)), results(st.Axis(20.0, "no pole", -2.0, math.inf))
    assert set(found["pole_evidence_deviations"]) == {6.5} and set(found["pole_evidence_needed"]) == {5.1}
    assert set(axis["pole_evidence_deviations"]) == {-2.0} and set(axis["pole_evidence_needed"]) == {math.inf}
    silent = results(st.Found(71.0))
    assert np.isnan(silent["pole_evidence_deviations"]).all() and np.isnan(silent["pole_evidence_needed"]).all()


@pytest.mark.parametrize(
    ("answer", "raised", "text"),
    [
        (lambda: 3, TypeError, "step returned 3: needed Drive, Found, Axis or Failed"),
        (lambda: st.Found(math.nan), ValueError, "an angle of NaN"),
        (lambda: st.Axis(1.0, evidence=4.0), ValueError, "evidence of 4 with needed of None: needed both"),
        (lambda: st.Found(1.0, needed=4.0), ValueError, "evidence of None with needed of 4"),
        (lambda: st.Found(1.0, evidence=math.nan, needed=4.0), ValueError, "evidence of NaN"),
        (lambda: st.Found(1.0, evidence=4.0, needed=-1.0), ValueError, "with needed of -1"),
        (lambda: st.Found(1.0, evidence="much", needed=1.0), TypeError, "str"),
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
