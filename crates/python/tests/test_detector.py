"""Detectors written in Python."""

import functools
import math
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

import numpy as np
import pytest

import standstill as st
from standstill._digest import name

OFF = ("off", "off", "off")
PULSE, REST = 80e-6, 600e-6
LINES = [("high", "low", "off"), ("off", "high", "low"), ("low", "off", "high")]


class Lines:
    """The paper's axis: equations (5) to (7) from the currents at the ends of three line pulses."""

    def __init__(self):
        self.inductances = []

    def step(self, readings):
        if len(self.inductances) < len(LINES) and len(readings):
            t, a, b, c, link, clipped = readings[-1][:6]
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
            assert readings.shape == (0, 13)
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


def test_law_a_pulse_until_a_threshold_ends_there_and_its_time_is_captured():
    sensors = "errors = 'none'\n[sensors]\narrangement = 'dc-link-shunt'\nterminals = true\ntimer = '0.32 us'\n"
    until = st.Drive([st.Stage(("high", "low", "low"), 3e-4), st.Stage(OFF, REST)], until=2.5)
    read = readings(until, sensors)[0]
    # Time, three currents, link, clipped, current of the shunt, three terminals, ticks, comparator, terminals clipped.
    assert read.shape == (13,) and read[0] == 0.0 and read[6] == pytest.approx(2.5, abs=0.02) and read[1] == read[6]
    assert np.isnan(read[2:4]).all() and read[7] > 500.0 and abs(read[8]) < 10.0 and read[11] == 0.0
    # The same pulse for as long as that took reads the same current.
    ticks = read[10]
    assert ticks == round(ticks) and 10 < ticks < 900
    first = ticks * 0.32e-6
    timed = st.Drive([st.Stage(("high", "low", "low"), 3e-4), st.Stage(OFF, REST)], first=first)
    again = readings(timed, sensors)[0]
    assert again[6] == pytest.approx(2.5, abs=0.02) and np.isnan(again[10:12]).all()
    # A drive that has none of it says so.
    plain = readings(timed)[0]
    # The last is a flag.
    assert np.isnan(plain[6:12]).all() and plain[12] == 0.0


def test_law_an_angle_that_it_names_is_judged():
    def results(end):
        return st.run("trials = 4\nrotor.angle = 70", detector=lambda: Watches(st.Drive([st.Stage(OFF, 1e-3)]), [], end))

    right, wrong, axis = results(st.Found(71.0)), results(st.Found(251.0)), results(st.Axis(-109.0, "no pole"))
    assert set(right["outcome"]) == set(wrong["outcome"]) == {"found"} and set(axis["outcome"]) == {"undetermined"}
    assert right["error_deg"] == pytest.approx([1.0] * 4) and wrong["error_deg"] == pytest.approx([-179.0] * 4)
    assert all(of["axis_error_deg"] == pytest.approx([1.0] * 4) for of in (right, wrong, axis))
    assert [of.summary["wrong_poles"] for of in (right, wrong, axis)] == [0, 4, 0]
    assert right["pole_correct"].all() and not wrong["pole_correct"].any()
    assert set(axis["reason"]) == {"no pole"} and right["reason"].mask.all()


def test_law_what_speaks_for_a_pole_stands_in_the_trace():
    def evidence(end):
        result = st.trace("trials = 2", detector=lambda: Watches(st.Drive([st.Stage(OFF, 1e-3)]), [], end)).result
        return result["pole_evidence_deviations"], result["pole_evidence_needed"]

    # There is no infinite number in JSON: where no amount would do, the entry is empty.
    assert evidence(st.Found(71.0, evidence=6.5, needed=5.1)) == (6.5, 5.1)
    assert evidence(st.Axis(20.0, "no pole", -2.0, math.inf)) == (-2.0, None)
    assert evidence(st.Found(71.0)) == (None, None)


def test_analytic_a_stated_age_refers_the_error_to_its_instant():
    text = "trials = 4\nrotor = { state = \"driven\", speed = \"10 rpm\", angle = 70 }"

    def results(end):
        return st.run(text, detector=lambda: Watches(st.Drive([st.Stage(OFF, 10e-3)]), [], end))

    # 10 rpm with four pole pairs: 240° a second.
    told, silent = results(st.Found(71.0, age=4e-3)), results(st.Found(71.0))
    assert told["error_deg"] == pytest.approx([1.0 - 2.4] * 4) and told["age_s"] == pytest.approx([4e-3] * 4)
    assert told["error_at_instant_deg"] == pytest.approx([1.0 - 2.4 + 0.96] * 4)
    assert silent["age_s"].mask.all() and silent["error_at_instant_deg"].mask.all()


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
        (lambda: st.Found(1.0, age=-1e-3), ValueError, "an age of -0.001 s: needed a time of zero or more"),
        (lambda: st.Drive([]), ValueError, "a command without a stage"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)] * 3), ValueError, "a command of 3 stages"),
        (lambda: st.Drive([st.Stage(("on", "off", "off"), 1e-3)]), ValueError, "a leg of 'on': needed"),
        (lambda: st.Drive([st.Stage((1.5, 0.0, 0.0), 1e-3)]), ValueError, "a leg of 1.5: needed"),
        (lambda: st.Drive([st.Stage(OFF, -1e-3)]), ValueError, "a duration of -0.001 s"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)], first=2e-3), ValueError, "a sample at 2000000 ns of a command of 1000000 ns"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)], interval=1e-9, count=2_000_000), ValueError, "with 2000000 samples, more than 1048576"),
        (lambda: st.Drive([st.Stage(OFF, 0.0)]), ValueError, "a command without duration"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)] * 2, until=-1.0), ValueError, "a command until -1 A, not until a finite current"),
        (lambda: st.Drive([st.Stage((0.5, "low", "low"), 1e-3)] * 2, until=1.0), ValueError, "whose first stage leg a switches"),
        (lambda: st.Drive([st.Stage(OFF, 1e-3)] * 2, first=2e-3, until=1.0), ValueError, "a sample at 2000000 ns after a trip"),
        (lambda: st.Found(2e6), ValueError, "an angle of 2000000: needed a number of degrees from -1000000 to 1000000"),
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


def test_regress_the_record_names_the_class_and_repeats():
    """It named `bipolar`, which repeating it ran."""
    results = st.run("trials = 4\nseed = 3", detector=Lines)
    record = results.run["scenario"]
    assert re.search(r'^python = "test_detector\.Lines@cpython3\.\d+:[0-9a-f]{16}"$', record, re.M), record
    assert "method" not in record and "bipolar" not in record
    again = st.run(record, detector=Lines)
    assert again.run == results.run and (again["axis_error_deg"] == results["axis_error_deg"]).all()
    traced = st.trace(record, trial=2, detector=Lines).result
    assert traced["axis_deg"] == pytest.approx(results["axis_deg"][2], abs=1e-6) and traced["scenario"] == record
    for command in (st.run, st.trace, st.budget):
        with pytest.raises(st.Error, match=r"`detector.python`: found .*Lines@.*needed `standstill.run\(scenario, detector=Lines\)`"):
            command(record)

    class Lines2(Lines):
        pass

    with pytest.raises(st.Error, match=r"`detector.python`: found .*Lines@.*needed .*Lines2@.*or no such key"):
        st.run(record, detector=Lines2)


BEFORE = """
STEP = 2
def helper(x): return x + STEP
class Base:
    def more(self): return helper(1)
class Own(Base):
    pulse = 80e-6
    def step(self, readings): return st.Failed("seen") if {"a", "b"} else self.more()
"""


def digest_of(text, change=lambda space: None, **more):
    """The name of a class as a notebook or the prompt makes it: without a file."""
    space = {"st": st, "__name__": "__main__", **more}
    exec(compile(text, "<cell>", "exec"), space)
    change(space)
    return name(space["Own"])


@pytest.mark.parametrize(
    "other",
    [
        BEFORE.replace("80e-6", "81e-6"),
        BEFORE.replace("STEP = 2", "STEP = 3"),
        BEFORE.replace("x + STEP", "x - STEP"),
        BEFORE.replace("helper(1)", "helper(2)"),
        BEFORE.replace("(Base)", ""),
        BEFORE.replace("self.more()", "self.fewer()"),
    ],
)
def test_law_a_digest_tells_what_a_class_is_made_of(other):
    assert digest_of(BEFORE) == digest_of(BEFORE), "made again, as a cell that is run twice"
    # Where it stands and what is said of it do not count.
    assert digest_of("\n\n# a line\n" + BEFORE) == digest_of(BEFORE)
    assert digest_of(BEFORE) != digest_of(other)


def test_law_a_digest_tells_what_a_class_was_given():
    def change(space):
        space["Own"].pulse = 81e-6

    assert digest_of(BEFORE, change) != digest_of(BEFORE)
    of = [name(functools.partial(Watches, command, [])) for command in (1, 2, 1)]
    assert of[0] == of[2] != of[1] and of[0].startswith("test_detector.Watches@")
    of = [name((lambda given: lambda: Watches(given, []))(np.arange(given))) for given in (3, 4, 3)]
    assert of[0] == of[2] != of[1]
    # One that refers to itself has an end.
    assert digest_of(BEFORE + "Own.itself = [Own, {'own': Own}]\n") != digest_of(BEFORE)


def test_law_a_digest_is_the_same_in_another_process(tmp_path):
    (tmp_path / "helpers.py").write_text("def twice(x): return once(x) * 2\ndef once(x): return x\n")
    (tmp_path / "own.py").write_text("import helpers\nNAMES = {'a', 'b', 'c'}\nclass Own:\n    def step(self, r): return helpers.twice(NAMES, {'p', 'q'})\n")

    def told(program):
        run = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True)
        return run.stdout.strip()

    import_it = "import own; from standstill._digest import name; print(name(own.Own))"
    first = told(import_it)
    assert first.startswith("own.Own@") and told(import_it) == first
    assert told("import helpers; helpers.once = lambda x: -x; " + import_it) != first
    (tmp_path / "program.py").write_text((tmp_path / "own.py").read_text() + "from standstill._digest import name\nprint(name(Own))\n")
    assert told("import runpy; runpy.run_path('program.py', run_name='own')").split("@")[1] == first.split("@")[1]


@pytest.mark.parametrize(
    "step",
    [
        "deep.more.twice(r)",
        "deep.through(r)",
        "given(r)",
        "late(r)",
    ],
)
def test_regress_a_digest_follows_own_modules_however_deep(tmp_path, step):
    package = tmp_path / "helpers" / "deep"
    package.mkdir(parents=True)
    (tmp_path / "helpers" / "__init__.py").write_text("from . import deep\n")
    # Modules that import each other have an end.
    (package / "__init__.py").write_text("from . import more\ndef through(x): return more.twice(x)\n")
    own = f"""
from helpers import deep
def given(r, module=deep): return module.more.twice(r)
def late(r):
    from helpers.deep.more import twice
    import helpers.deep.more as again, numpy, nowhere
    return twice(r) + again.FACTOR
class Own:
    def step(self, r): return {step}
"""
    (tmp_path / "own.py").write_text(own)

    def told(factor):
        (package / "more.py").write_text(f"import helpers\nFACTOR = {factor}\ndef once(x): return FACTOR * x\ndef twice(x): return once(once(x))\n")
        program = "import own; from standstill._digest import name; print(name(own.Own))"
        return subprocess.run([sys.executable, "-B", "-c", program], cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    assert told(2) == told(2) != told(3)


def test_regress_a_detector_table_beside_a_class_is_refused():
    for table, key in [('[detector]\nmethod = "bipolar"', "method"), ('[detector]\npulse = "80 us"', "pulse"), ('[axes]\n"detector.pulse" = ["40 us", "80 us"]', "pulse")]:
        with pytest.raises(st.Error, match=f"`detector.{key}`: found a setting that does not reach the class test_detector.Lines .*needed either a method's table"):
            st.run(f"trials = 3\n{table}", detector=Lines)
    # Settings of its own reach a class that takes them.
    with pytest.raises(st.Error, match="`detector.config.gain`: found 2, needed a class whose `__init__` has an argument `config`"):
        st.run("trials = 3\ndetector.config.gain = 2", detector=Lines)
    # The limit of time is the bench's.
    assert st.run('trials = 2\ndetector.time_limit = "1 s"', detector=Lines).rows == 2


class Forever:
    """Commands without end."""

    def __init__(self, duration):
        self.drive = st.Drive([st.Stage(OFF, duration)])

    def step(self, readings):
        return self.drive


def test_regress_a_detection_without_end_fails_as_a_librarys_does():
    short = st.run("trials = 1", detector=functools.partial(Forever, 100e-9))
    assert set(short["reason"]) == {"not done within 100000 commands of less than 1 us on average"} and short.summary["failed"] == 1
    long = st.run("trials = 2\ndetector.time_limit = 0.5", detector=functools.partial(Forever, 1e-2))
    assert set(long["reason"]) == {"not done within 0.5 s"} and set(long["outcome"]) == {"failed"}


class Told(Lines):
    """Keeps what it is made with."""

    def __init__(self, drive, config, seed):
        super().__init__()
        TOLD.append((drive, config, seed))
        self.left = config.get("pulses", 1)

    def step(self, readings):
        self.left -= 1
        return st.Drive([st.Stage(OFF, 1e-3)]) if self.left >= 0 else st.Failed(f"after {self.left}")


TOLD: list = []


def told(text, **more):
    TOLD.clear()
    results = st.run(text, detector=Told, threads=1, **more)
    return results, list(TOLD)


def test_law_a_class_is_told_what_the_drive_knows():
    """The numbers of the sheet and of the sensors, as `sts_drive` has them in C."""
    sheet = {entry["key"]: entry["value"] for entry in st.motors("paper-5k5")["entries"]}
    text = "trials = 2\nmotor = 'paper-5k5'\n[sensors]\nrange = '20 A'\nbits = 12\noversampling = 4\n[inverter]\ndead_time = '1.5 us'\ncarrier = '8 kHz'\n"
    _, made = told(text)
    drive = made[0][0]
    assert len(made) == 2 and made[1][0] == drive and isinstance(drive, st.Nameplate)
    assert drive.dc_link == 550.0 and drive.rated_current > 1.0 and drive.stronger_pole == 1, (drive, sheet)
    assert drive.ld < drive.lq and 0.1 < drive.flux < 2.0 and 0.1 < drive.resistance < 5.0
    # A code is a 4096th of twice the range, and a count the sum of four codes.
    assert drive.current_bits == 12 and drive.amps_per_count == pytest.approx(40.0 / 4096 / 4) and drive.amps_at_zero == -20.0
    assert (drive.dead_time, drive.period, drive.comparators, drive.timer_tick) == (1.5e-6, 1.25e-4, 0, 0.0)
    wrong = told(text + "[detector]\nsignature = 'inverted'\ndead_time = '2 us'\n")[1][0][0]
    assert (wrong.stronger_pole, wrong.dead_time) == (-1, pytest.approx(2e-6))
    compared = told("trials = 1\n[sensors]\narrangement = 'dc-link-shunt'\ntimer = '0.32 us'\n")[1][0][0]
    assert (compared.timer_tick, compared.comparators) == (pytest.approx(0.32e-6), 1)
    # The drive does not know the motor of a trial, but that of the sheet.
    drawn = told("trials = 20\n[tolerances]\n'motor.winding.resistance' = { normal = '10 %' }\n")[1]
    assert len({drive.resistance for drive, _, _ in drawn}) == 1


def test_law_each_trial_has_a_seed_of_its_own():
    seeds = [seed for _, _, seed in told("trials = 30")[1]]
    assert len(set(seeds)) == 30 and max(seeds) > 2**62 and seeds == [seed for _, _, seed in told("trials = 30")[1]]
    assert set(seeds).isdisjoint(seed for _, _, seed in told("trials = 30", seed=5)[1])


def test_law_settings_of_its_own_are_axes_too():
    results, made = told('trials = 2\n[detector.config]\npulses = 2\nname = "a"\nshare = 0.5\non = true')
    assert made[0][1] == {"pulses": 2, "name": "a", "share": 0.5, "on": True} and type(made[0][1]["on"]) is bool
    swept = st.sweep("trials = 3\ndetector.config.pulses = 1", vary={"detector.config.pulses": "1:5:3"}, detector=Told)
    assert [point["values"]["detector.config.pulses"] for point in swept.points] == [1, 3, 5]
    # A command more takes a millisecond more.
    assert (swept["duration_s"] * 1e3).round(6).tolist() == [1.0] * 3 + [3.0] * 3 + [5.0] * 3
    assert results.run["scenario"] != swept.run["scenario"]


def test_law_a_trace_shows_the_drive_of_a_class():
    trace = st.trace("trials = 5", trial=3, detector=Lines)
    run = st.run("trials = 5", detector=Lines)
    assert trace.result["outcome"] == "undetermined" and trace.result["axis_deg"] == pytest.approx(run["axis_deg"][3], abs=1e-6)
    # Three pulses, each with its current.
    peak = np.abs(trace.waveform["i_a_A"]).max()
    assert (trace.events["event"] == "sample").sum() == 3 and 1.0 < peak < 20.0
    assert "Lines" in trace.waveform.metadata["scenario"]
    with pytest.raises(ZeroDivisionError):
        st.trace("trials = 5", detector=lambda: 1 / 0)


class Six:
    """Six pulses, each the other way of another, and the axis from their currents; the pole from what they differ by."""

    def __init__(self):
        ways = [("high", "low", "off"), ("off", "high", "low"), ("low", "off", "high")]
        self.left = [way for pair in [(way, tuple({"high": "low", "low": "high"}.get(leg, leg) for leg in way)) for way in ways] for way in pair]
        self.sums = []

    def step(self, readings):
        if len(readings):
            self.sums.append(np.abs(readings[-1, 1:4]).max())
        if self.left:
            return st.Drive([st.Stage(self.left.pop(0), 80e-6), st.Stage(OFF, 600e-6)], first=80e-6)
        lines = np.array(self.sums).reshape(3, 2)
        second = (lines.mean(axis=1) * np.exp(2j * np.radians([-30.0, 90.0, 210.0]))).sum()
        axis = np.angle(second) / 2
        first = ((lines[:, 0] - lines[:, 1]) * np.exp(1j * np.radians([-30.0, 90.0, 210.0]))).sum()
        return st.Found(np.degrees(axis) + (0.0 if (first * np.exp(-1j * axis)).real > 0.0 else 180.0))


def test_law_questions_take_a_class_as_runs_do(tmp_path):
    scenario = 'motor = "paper-5k5"\ntrials = 60'
    run = st.run(scenario, detector=Six, out=tmp_path / "run")
    assert run.summary["found"] == 60 and run.summary["rms_deg"]["value"] < 8.0
    rows = st.compare(scenario, method="bipolar", errors="default", rotor="locked", detector=Six)
    assert [row["method"].split(".")[-1] for row in rows] == ["Six", "bipolar"]
    # The rows of the class are those of its run: the same draws of the same seed.
    assert rows[0]["rms_deg"] == pytest.approx(run.summary["rms_deg"]["value"], rel=1e-6)
    shares = st.budget(scenario, pairs=100, detector=Six)
    assert "Six" in shares["method"]
    twice = 2 * run.summary["rms_deg"]["value"]
    answer = st.require(scenario, key="sensors.gain_error", limit=f"rms <= {twice} deg", most=1000, detector=Six)
    assert answer["answer"] == "at most"
    half = st.odds(scenario, event="|e| > 3 deg", effort="quick", detector=Six)
    share = (np.abs(run["axis_error_deg"]) > 3.0).mean()
    assert half["low"] - 0.2 <= share <= half["high"] + 0.2
    open_phase = st.faults(scenario, mode="phase-open", trials=40, detector=Six)
    assert open_phase["rows"][1]["trials"] == 40
    worst = int(run["trial"][np.abs(run["axis_error_deg"]).argmax()])
    again = st.explain(tmp_path / "run", worst=1, detector=Six)
    assert again["trials"][0]["trial"] == worst
    with pytest.raises(st.Error, match="a class that this run does not have"):
        st.explain(tmp_path / "run", worst=1)
    (tmp_path / "needs.toml").write_text('[[requirement]]\nid = "A"\ntext = "angle"\nlimit = "rms <= 20 deg"\n')
    verdict = st.qualify(scenario, tmp_path / "needs.toml", witness=False, detector=Six)
    assert verdict["requirements"][0]["verdict"] == "passed"


def test_law_its_files_are_those_of_any_run(tmp_path):
    memory = st.run("trials = 50", detector=Lines)
    for format in ("csv", "parquet"):
        written = st.run("trials = 50", detector=Lines, out=tmp_path / format, format=format)
        assert written == memory or written.run == memory.run and written.summary == memory.summary
        assert sorted(path.name for path in (tmp_path / format).iterdir()) == ["summary.json", f"trials.{format}"]
    none = st.run("trials = 50", detector=Lines, rows="none")
    assert none.summary == memory.summary and none.rows == 0
    # A shard of each half, in any process that has the class.
    for part in ("1/2", "2/2"):
        st.shard("trials = 50", part, out=tmp_path / "shards", detector=Lines)
    assert st.merge(tmp_path / "shards").summary == memory.summary
    early = st.run("trials = 4000", detector=Lines, stop_at={"rms": "20%"})
    assert early.rows == early.summary["trials"] < 4000


class Breaks(Lines):
    """Raises in all trials from the one on whose seed a file names."""

    def __init__(self, seed):
        super().__init__()
        self.seed = seed

    def step(self, readings):
        if BROKEN.exists() and BROKEN.read_text() == str(self.seed):
            raise RuntimeError("broken")
        return super().step(readings)


BROKEN = pathlib.Path(tempfile.gettempdir()) / f"standstill-broken-{os.getpid()}"


def test_law_a_run_goes_on_where_a_class_raised(tmp_path):
    """Rows up to the trial that raised are kept, none of it or behind it, and the same class goes on."""
    whole = st.run("trials = 900", detector=Lines, out=tmp_path / "whole")
    seeds = [seed for _, _, seed in told("trials = 900")[1]]
    try:
        BROKEN.write_text(str(seeds[700]))
        with pytest.raises(RuntimeError, match="broken") as error:
            st.run("trials = 900", detector=Breaks, out=tmp_path / "run")
        assert error.value.trial == 700
        assert [path.name for path in (tmp_path / "run").iterdir()] == ["run.journal"]
    finally:
        BROKEN.unlink()
    with pytest.raises(st.Error, match="needed resume=True"):
        st.run("trials = 900", detector=Breaks, out=tmp_path / "run")
    # Another class is another run.
    with pytest.raises(st.Error, match="Lines@"):
        st.run("trials = 900", detector=Lines, out=tmp_path / "run", resume=True)
    results = st.run("trials = 900", detector=Breaks, out=tmp_path / "run", resume=True)
    # A comparison of masked arrays leaves out empty cells, such as those of a trial that raised.
    assert results.summary == whole.summary and results.summary["failed"] == 0 and results.rows == 900
    assert (np.ma.getdata(results["axis_error_deg"]) == np.ma.getdata(whole["axis_error_deg"])).all()


def test_law_what_is_wrong_with_the_scenario_is_said_of_a_class_too():
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
