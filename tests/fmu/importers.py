"""FMUs as other programs meet them: FMPy's validation without a finding; samples that are those of `standstill trace`; FMPy
(FMI 2.0 and 3.0) and libcosim with the same figures.

    python tests/fmu/importers.py path/to/standstill

Ends with 77 where FMPy is not there.
"""

import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import fmpy
    import numpy as np
    from fmpy import calloc, free
    from fmpy.fmi1 import FMICallException
    from fmpy.fmi2 import (
        FMU2Slave,
        fmi2CallbackAllocateMemoryTYPE,
        fmi2CallbackFreeMemoryTYPE,
        fmi2CallbackFunctions,
        fmi2CallbackLoggerTYPE,
    )
    from fmpy.fmi3 import FMU3Slave
    from fmpy.validation import validate_fmu
except ImportError as error:
    print(f"{error.name} is not here: the part with FMUs was left out")
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[2]
STEPS = 40
PERIOD = 80e-6
SETTINGS = {"trial": 3, "sample_at": 0.5}
OUTPUTS = ["sampled.i_a", "sampled.i_b", "sampled.i_c", "sampled.u_dc"]


def legs(n):
    """The plan of open_loop.c, one step later: mode and duty of each leg."""
    if n == 0:
        return [(0, 0.0)] * 3
    duty = [0.5 + n * (k + 1) % 5 / 128 for k in range(3)]
    modes = [2, 1, 0] if n % 8 == 0 else [0, 0, 0] if n % 8 == 1 else [3, 3, 3]
    return list(zip(modes, duty))


def by_fmpy(path, folder):
    """The samples of each step, called function by function."""
    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    of = {"unzipDirectory": fmpy.extract(path, folder), "guid": description.guid, "instanceName": "drive"}
    of["modelIdentifier"] = description.coSimulation.modelIdentifier
    second = description.fmiVersion == "2.0"
    slave = (FMU2Slave if second else FMU3Slave)(**of)
    real = slave.setReal if second else slave.setFloat64
    whole = slave.setInteger if second else slave.setInt32
    chosen = slave.setInteger if second else slave.setInt64
    slave.instantiate()
    if second:
        slave.setupExperiment(startTime=0.0)
    for name, value in SETTINGS.items():
        (whole if isinstance(value, int) else real)([reference[name]], [value])
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    seen = []
    for n in range(STEPS):
        for phase, (mode, duty) in zip("abc", legs(n)):
            chosen([reference[f"mode_{phase}"]], [mode])
            real([reference[f"duty_{phase}"]], [duty])
        slave.doStep(currentCommunicationPoint=n * PERIOD, communicationStepSize=PERIOD)
        seen.append((slave.getReal if second else slave.getFloat64)([reference[name] for name in OUTPUTS]))
    slave.terminate()
    slave.freeInstance()
    return np.array(seen)


def by_event_mode(path, folder):
    """FMI 3.0 with its clock: what goes in and out at the ticks."""
    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    of = {"unzipDirectory": fmpy.extract(path, folder), "guid": description.guid, "instanceName": "clocked"}
    slave = FMU3Slave(modelIdentifier=description.coSimulation.modelIdentifier, **of)
    slave.instantiate(eventModeUsed=True)
    slave.setInt32([reference["trial"]], [SETTINGS["trial"]])
    slave.setFloat64([reference["sample_at"]], [SETTINGS["sample_at"]])
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    seen = []
    for n in range(STEPS + 1):
        if n:
            slave.enterEventMode()
        slave.setClock([reference["pwm"]], [True])
        if n:
            seen.append(slave.getFloat64([reference[name] for name in OUTPUTS]))
        for phase, (mode, duty) in zip("abc", legs(n)):
            slave.setInt64([reference[f"mode_{phase}"]], [mode])
            slave.setFloat64([reference[f"duty_{phase}"]], [duty])
        slave.updateDiscreteStates()
        slave.enterStepMode()
        if n < STEPS:
            slave.doStep(currentCommunicationPoint=n * PERIOD, communicationStepSize=PERIOD)
    slave.terminate()
    slave.freeInstance()
    return np.array(seen)


def forked(path, folder):
    """A run goes on in another instance, from a state in bytes: the bytes' size, and how many samples have the same bits."""
    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    second = description.fmiVersion == "2.0"
    assert description.coSimulation.canSerializeFMUstate
    of = {"unzipDirectory": fmpy.extract(path, folder), "guid": description.guid, "instanceName": "forked"}
    of["modelIdentifier"] = description.coSimulation.modelIdentifier

    def stepped(slave, steps):
        for n in steps:
            for phase, (mode, duty) in zip("abc", legs(n)):
                (slave.setInteger if second else slave.setInt64)([reference[f"mode_{phase}"]], [mode])
                (slave.setReal if second else slave.setFloat64)([reference[f"duty_{phase}"]], [duty])
            slave.doStep(currentCommunicationPoint=n * PERIOD, communicationStepSize=PERIOD)
            yield (slave.getReal if second else slave.getFloat64)([reference[name] for name in OUTPUTS])

    slaves = [(FMU2Slave if second else FMU3Slave)(**of) for _ in range(2)]
    for slave in slaves:
        slave.instantiate()
    first, other = slaves
    if second:
        first.setupExperiment(startTime=0.0)
    (first.setInteger if second else first.setInt32)([reference["trial"]], [SETTINGS["trial"]])
    first.enterInitializationMode()
    first.exitInitializationMode()
    assert len(list(stepped(first, range(15)))) == 15
    state = first.getFMUState()
    bytes_of = first.serializeFMUState(state)
    first.freeFMUState(state)
    state = other.deserializeFMUState(bytes_of)
    other.setFMUState(state)
    other.freeFMUState(state)
    samples = [list(stepped(slave, range(15, STEPS))) for slave in slaves]
    assert samples[0] == samples[1], "a run that was forked has other samples"
    for slave in slaves:
        slave.terminate()
        slave.freeInstance()
    return len(bytes_of), np.size(samples[0])


def told(path, folder):
    """How many starts of the description are what an instance has; and that an angle that is set counts."""
    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    of = {"unzipDirectory": fmpy.extract(path, folder), "guid": description.guid, "instanceName": "told"}
    of["modelIdentifier"] = description.coSimulation.modelIdentifier
    second = description.fmiVersion == "2.0"
    slave = (FMU2Slave if second else FMU3Slave)(**of)
    real, whole = (slave.getReal, slave.getInteger) if second else (slave.getFloat64, slave.getInt32)
    get = {"Real": real, "Float64": real, "Integer": whole, "Int32": whole, "Enumeration": whole if second else slave.getInt64, "Boolean": slave.getBoolean}
    slave.instantiate()
    if second:
        slave.setupExperiment(startTime=0.0)
    starts = [variable for variable in description.modelVariables if variable.start is not None]
    for variable in starts:
        (found,) = get[variable.type]([variable.valueReference])
        start = variable.start == "true" if variable.type == "Boolean" else float(variable.start)
        assert found == start, (variable.name, found, start)
        assert variable.unit != "deg", variable.name
    (slave.setReal if second else slave.setFloat64)([reference["rotor.angle"]], [1.0])
    slave.enterInitializationMode()
    prefix = "actual." if "actual.angle" in reference else ""
    (angle,) = real([reference[f"{prefix}angle"]])
    (draws,) = slave.getBoolean([reference["rotor.draw_angle"]])
    assert abs(angle - 1.0) < 0.02 and not draws, (angle, draws)
    if prefix:
        link, sampled = real([reference["actual.u_dc"], reference["sampled.u_dc"]])
        assert abs(sampled - link) < 0.05 * link, (sampled, link)
    slave.exitInitializationMode()
    slave.terminate()
    slave.freeInstance()
    return len(starts)


def refused(path, folder):
    """What an FMU says of parameters that cannot be, as FMPy hears it."""
    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    of = {"unzipDirectory": fmpy.extract(path, folder), "guid": description.guid, "instanceName": "refused"}
    slave = FMU2Slave(modelIdentifier=description.coSimulation.modelIdentifier, **of)
    said = []
    hear = fmi2CallbackLoggerTYPE(lambda environment, instance, status, category, message: said.append(message.decode()))
    callbacks = fmi2CallbackFunctions()
    callbacks.logger = hear
    callbacks.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
    callbacks.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
    slave.instantiate(callbacks=callbacks)
    cases = [
        ("inverter.dead_time", 20e-6, "found 20 µs, needed from 0 to 19.999 µs: less than a quarter of the PWM period of 80 µs"),
        ("inverter.dc_link", 0.0, "found 0 V, needed at least 1 mV"),
        ("sensors.gain_error", 1.5, "found 1.5, needed a share from 0 to 1"),
    ]
    for name, value, says in cases:
        try:
            slave.setReal([reference[name]], [value])
        except FMICallException:
            assert said.pop() == f"`{name}`: {says}" and not said, said
        else:
            raise AssertionError(f"{name} of {value} was taken")
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.terminate()
    slave.freeInstance()
    return len(cases)


def by_libcosim(path):
    """The same by libcosim."""
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    description = fmpy.read_model_description(path)
    reference = {variable.name: variable.valueReference for variable in description.modelVariables}
    execution = CosimExecution.from_step_size(round(PERIOD * 1e9))
    slave = execution.add_local_slave(CosimLocalSlave(fmu_path=str(path), instance_name="drive"))
    execution.integer_initial_value(slave, reference["trial"], SETTINGS["trial"])
    execution.real_initial_value(slave, reference["sample_at"], SETTINGS["sample_at"])
    manipulator, observer = CosimManipulator.create_override(), CosimObserver.create_last_value()
    execution.add_manipulator(manipulator)
    execution.add_observer(observer)
    seen = []
    for n in range(STEPS):
        modes, duties = zip(*legs(n))
        manipulator.slave_integer_values(slave, [reference[f"mode_{phase}"] for phase in "abc"], list(modes))
        manipulator.slave_real_values(slave, [reference[f"duty_{phase}"] for phase in "abc"], list(duties))
        execution.step()
        seen.append(observer.last_real_values(slave, [reference[name] for name in OUTPUTS]))
    return np.array(seen)


def by_trace(standstill, folder):
    """What `standstill trace` samples with the same legs, by a library in C."""
    library = folder / "open_loop.so"
    include = ["-I", str(ROOT / "crates/foreign/include")]
    subprocess.run(["cc", "-shared", "-fPIC", *include, "-o", library, ROOT / "tests/fmu/open_loop.c"], check=True)
    words = ["trace", folder / "drive.toml", "--detector", library, "--trial", SETTINGS["trial"], "--out", folder / "trace"]
    words += ["--format", "npz"]
    subprocess.run([standstill, *map(str, words)], check=False, stdout=subprocess.DEVNULL)
    # A text file would round to a microampere.
    events = np.load(folder / "trace/events.npz")
    return np.stack([events[name][events["event"] == "sample"] for name in ("i_a_A", "i_b_A", "i_c_A", "u_dc_V")], axis=1)


def main(standstill):
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        (folder / "drive.toml").write_text('motor = "low-inertia"\ninverter.carrier = 12500\nerrors = "field"\nseed = 7\nrotor.state = "free"\n')
        for version in "23":
            for part in ("drive", "motor"):
                path = folder / f"{part}{version}.fmu"
                words = ["fmu", folder / "drive.toml", "--part", part, "--fmi", version, "-o", path]
                subprocess.run([standstill, *map(str, words)], check=True, stdout=subprocess.DEVNULL)
                findings = validate_fmu(str(path))
                assert not findings, findings
                print(f"{path.name}: {path.stat().st_size / 1e6:.1f} MB, no finding of FMPy's validation")
                print(f"{path.name}: {told(path, folder / f'told-{part}{version}')} starts are what the instance has")
        print(f"{refused(folder / 'drive2.fmu', folder / 'refused')} parameters that cannot be are refused with a message")
        for version in "23":
            size, samples = forked(folder / f"drive{version}.fmu", folder / f"forked{version}")
            print(f"drive{version}.fmu: a run forked from a state of {size} bytes has the bits of the other, {samples} samples")
        second = by_fmpy(folder / "drive2.fmu", folder / "two")
        assert abs(second[:, :3]).max() > 0.3
        others = {"FMPy, FMI 3.0": by_fmpy(folder / "drive3.fmu", folder / "three")}
        others["FMPy, FMI 3.0 with its clock"] = by_event_mode(folder / "drive3.fmu", folder / "clocked")
        if shutil.which("cc"):
            others["standstill trace"] = by_trace(standstill, folder)
        else:
            print("cc is not here: the comparison with a trace was left out (cargo test has one)")
        try:
            others["libcosim, FMI 2.0"] = by_libcosim(folder / "drive2.fmu")
        except (ImportError, OSError) as error:
            print(f"libcosimpy is not here or does not load ({error}): left out")
        for other, samples in others.items():
            assert samples.shape == second.shape, (other, samples.shape)
            off = abs(samples - second).max()
            assert off < 1e-9, (other, off)
            print(f"{other}: {STEPS} steps as by FMPy, FMI 2.0, within {off:.1e} A and V")
        # A whole simulation by FMPy's own loop, of the motor too.
        result = fmpy.simulate_fmu(str(folder / "motor2.fmu"), stop_time=0.01, start_values={"u_a": 10.0, "u_b": -5.0, "u_c": -5.0})
        assert abs(result["i_a"][-1]) > 0.1 and abs(result["i_a"] + result["i_b"] + result["i_c"]).max() < 1e-9
        print(f"motor2.fmu: i_a is {result['i_a'][-1]:.3f} A after 10 ms at 10 V")


if __name__ == "__main__":
    main(sys.argv[1])
