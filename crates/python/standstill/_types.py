"""Scenarios, and choices of options, as types. Written by crates/python/scripts/write_types.py from the program's schema; a test compares."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, TypeAlias, TypedDict, Union

from ._sheet import MotorSpec

#: Choices of the option `format`.
Format: TypeAlias = Literal["csv", "parquet", "npz", "mat"]

#: Choices of the option `rows`.
Rows: TypeAlias = Literal["all", "none"]

#: Choices of the option `effort`.
Effort: TypeAlias = Literal["quick", "normal", "high"]

#: For the schema alone.
NumberOrText: TypeAlias = Union[float, str]

#: A range of numbers.
AxisTable = TypedDict("AxisTable", {
    "from": NumberOrText,  # The first value, such as `"0 mA"` or `5`.
    "log": bool,  # True if neighbours have the same ratio instead of the same difference.
    "points": int,  # Number of values of a grid, both ends included. Other designs spread all their points over the range.
    "to": NumberOrText,  # The last, in a unit of the same dimension.
}, total=False)

#: 
Axis: TypeAlias = Union[Sequence[Any], AxisTable]

#: The choice of points from the axes.
DesignKind: TypeAlias = Literal["grid", "latin-hypercube", "sobol"]

class DesignTable(TypedDict, total=False):
    "The points of the axes that are run."

    #: The choice of points.
    kind: DesignKind
    #: Number of points; that of a grid follows from its axes.
    points: int

#: True for all checks, false for none, or a list of those that are on.
Checks: TypeAlias = Union[bool, Sequence[Literal["link", "sensors", "inductance", "both-ways", "contact", "codes", "turning"]]]

#: A setting of a library: a text, a number, or true or false.
Scalar: TypeAlias = Union[str, float, bool]

#: The methods.
MethodName: TypeAlias = Literal["line-inductance", "line-inductance-fast", "subdivision", "hfi-rotating", "hfi-pulsating", "dc-alignment", "bipolar", "maximum-likelihood", "maximum-likelihood-adaptive", "open-terminal", "six-pulse"]

#: The rule by which the pole is decided, in methods that find the axis first and then run a separate polarity test.
PoleRule: TypeAlias = Literal["two-vectors", "sequential"]

#: Which of two opposite voltage vectors along the d-axis raises the larger current: a property of the motor's magnetics, and the one thing about the poles that no measurement at standstill can tell.
Signature: TypeAlias = Literal["normal", "inverted", "none"]

class DetectorTable(TypedDict, total=False):
    "The method and its settings. What is left out suits the motor; a setting that the method does not have is an error."

    #: Corner frequency of the current sensors' filters as their data sheet states it; 0: no filter.
    bandwidth: Union[float, str]
    #: With --isolate, the longest time that a call of the library may take on the clock. Without it, 1 s.
    call_timeout: Union[float, str]
    #: Which checks are on whether readings can be those of whole parts and of a rotor that stands: true for all, false for none, or a list.
    checks: Checks
    #: Whether the dividers at the terminals are compared on an all-high vector first.
    comparison: bool
    #: Whether an injection compensates dead time and drops.
    compensation: bool
    #: Settings of the library, handed over as lines KEY=VALUE.
    config: Mapping[str, Scalar]
    #: Dead time that the detector assumes.
    dead_time: Union[float, str]
    #: Standard deviation of the angle at which an adaptive method is content.
    deviation: Union[float, str]
    #: Standard deviation of the gains of the current sensors, or of the dividers at the terminals, that the detector assumes; 0: equal.
    gain_tolerance: Union[float, str]
    #: |L_B| / L_A below which no angle is named.
    least_saliency: Union[float, str]
    #: A shared library that is the detector in place of a method, by its path: see docs/firmware.md.
    library: str
    #: The method.
    method: MethodName
    #: Whether of six pulses each is followed by the opposite one, and not by the next around the circle.
    pairs: bool
    #: How long all switches are open after each of six pulses, as a share of the longest pulse; less than about two thirds leaves a current to the next pulse, which turns axis and pole.
    pause: Union[float, str]
    #: The rule by which poles are decided.
    polarity: PoleRule
    #: Probability of a wrong pole that is allowed.
    pole_error: Union[float, str]
    #: Length of the line pulses.
    pulse: Union[float, str]
    #: A class of Python in place of a method, as `module.Class@digest`. `standstill.run(..., detector=Class)` writes it into the record of its run, and runs it: see docs/python.md.
    python: str
    #: How long all switches are open after each line pulse both ways, as a share of the pulse; the current needs a little less than the pulse to decay.
    rest: Union[float, str]
    #: Times that all lines are pulsed, or pulses per line.
    rounds: Union[float, str]
    #: Width of the sectors in which six pulses answer: 30° or 60°; 0: not in sectors.
    sector: Union[float, str]
    #: The pole that draws more current, as the detector assumes, right or wrong.
    signature: Signature
    #: Current at which each of six pulses ends; without a timer, that for which it is made.
    threshold: Union[float, str]
    #: Longest time that a detection may take, in simulated time: one that is not done by then fails. Without it, 20 s.
    time_limit: Union[float, str]
    #: Whether six pulses are timed until a comparator trips, and not sampled after a time.
    timed: bool
    #: Current of a polarity test's vectors.
    vector_current: Union[float, str]
    #: Amplitude of an injected voltage.
    voltage: Union[float, str]
    #: With one shunt in the DC link, how long each of the two vectors of a carrier period is at least in which an injection samples it: edges are shifted for it, and back in the next period.
    window: Union[float, str]

#: How good drive and sensors are.
ErrorSet: TypeAlias = Literal["none", "noise", "default", "harsh", "field"]

#: The phase, leg or sensor at which a fault is.
FaultPlace: TypeAlias = Literal["a", "b", "c", "any"]

#: A value, or the smallest and the largest of those that trials draw.
Between: TypeAlias = Union[Union[str, float], Sequence[Union[str, float]]]

#: A failure mode: the part that is broken, and how.
FaultMode: TypeAlias = Literal["phase-open", "contact-resistance", "turns-shorted", "terminals-swapped", "terminals-turned", "magnet-weak", "sheet-signature", "sheet-inductance", "sheet-resistance", "upper-switch-open", "lower-switch-open", "leg-off", "dead-time-long", "link-capacitor-aged", "supply-weak", "current-dead", "current-frozen", "current-stuck", "current-bit", "current-gain", "current-offset", "current-sign", "currents-swapped", "current-slow", "reference-drift", "sample-late", "link-gain", "link-stuck", "comparator-stuck", "timer-off", "command-late", "duty-limited", "sample-lost"]

class FaultTable(TypedDict, total=False):
    "A fault of motor, inverter, sensors or software."

    #: The phase, leg or sensor; without it, each trial draws one.
    at: FaultPlace
    #: Number of the detection's command, from 1, from whose begin `onset` counts, or a list of two between which each trial draws one.
    command: Between
    #: Coupling of the turns of `turns-shorted` with their phase, or a list of two between which each trial draws one; 0.9 without it.
    coupling: Between
    #: Time after which it is whole again, as an intermittent contact. Without it, it stays broken.
    lasts: Union[float, str]
    #: The size, such as `"2 Ω"`, or a list of two between which each trial draws one. Its unit is that of the mode.
    magnitude: Between
    #: The failure mode.
    mode: FaultMode
    #: Time after the start of the detection, or of `command`, at which it breaks. Without both, before the detection.
    onset: Between
    #: Resistance in the path of `turns-shorted`, or a list of two between which each trial draws one; 0 Ω without it.
    resistance: Between

#: What the switches are.
DeviceKind: TypeAlias = Literal["igbt", "mosfet"]

#: What an idle leg (both switches off, no current) may do.
OpenLeg: TypeAlias = Literal["diodes", "open"]

class InverterTable(TypedDict, total=False):
    "The inverter and its DC link."

    #: Capacitor of the DC link; 0: none, the link has the source's voltage at any current.
    capacitance: Union[float, str]
    #: Frequency of the PWM carrier.
    carrier: Union[float, str]
    #: Resistance of a MOSFET's channel, which conducts both ways while its gate is on.
    channel_resistance: Union[float, str]
    #: Voltage of the DC link. Without it, the motor's.
    dc_link: Union[float, str]
    #: Dead time.
    dead_time: Union[float, str]
    #: Standard deviation of the legs' switching delays.
    delay_mismatch: Union[float, str]
    #: Kind of the switches. Without it, MOSFETs where the motor's DC link is at most 60 V, else IGBTs.
    devices: DeviceKind
    #: Voltage across a conducting diode at no current.
    diode_drop: Union[float, str]
    #: Slope of the voltage across a conducting diode over its current.
    diode_resistance: Union[float, str]
    #: Behaviour of a leg with both switches off. Where terminals have a capacitance its diodes conduct, in every error set.
    open_leg: OpenLeg
    #: Amplitude of the DC link's ripple, a share of its voltage.
    ripple: Union[float, str]
    #: Frequency of the DC link's ripple.
    ripple_frequency: Union[float, str]
    #: Depth of a sag of the source, a share of the voltage: a smooth trough, deepest in its middle. 0: none.
    sag_depth: Union[float, str]
    #: Duration of the sag.
    sag_duration: Union[float, str]
    #: Start of the sag, after the start of the detection. Without it, at once.
    sag_start: Union[float, str]
    #: Resistance through which the source feeds the capacitor.
    source_resistance: Union[float, str]
    #: Voltage across a conducting IGBT at no current.
    switch_drop: Union[float, str]
    #: Slope of the voltage across a conducting IGBT over its current.
    switch_resistance: Union[float, str]
    #: Capacitance of each terminal to the negative rail, of switches and cable: a leg in which no device conducts charges it and rings with the winding. 0: none.
    terminal_capacitance: Union[float, str]
    #: Resistance of the winding, one phase against the two others, at the frequency of the ringing with the terminals' capacitance: eddy currents in sheets and conductors make it far larger than for direct current. An LCR meter reads it in series with the inductance.
    terminal_resistance: Union[float, str]

#: Memory of the stator's iron at the start, where the motor's data sheet has a hysteresis.
Memory: TypeAlias = Literal["virgin", "former"]

#: Motion of the rotor.
Rotor: TypeAlias = Literal["locked", "free", "brake", "driven"]

class RotorTable(TypedDict, total=False):
    "The rotor and what pulls at it."

    #: Acceleration of the shaft of a rotor that is "driven": `speed` is that at the start.
    acceleration: Union[float, str]
    #: Electrical angle at the start, one for all trials. Without it each trial draws its own, uniformly.
    angle: Union[float, str]
    #: Torque that a load exerts against forward motion, also at standstill.
    load: Union[float, str]
    #: Temperature of the magnets. The drive does not know it.
    magnet_temperature: Union[float, str]
    #: Magnetisation of the stator's iron at the start, of a motor whose data sheet has a `[hysteresis]`.
    memory: Memory
    #: Speed of the shaft at the start, forwards or backwards: of a rotor that coasts ("free") or is "driven".
    speed: Union[float, str]
    #: Motion of the rotor: held, free, or free within the play of a brake.
    state: Rotor
    #: Temperature of the winding. The drive does not know it.
    winding_temperature: Union[float, str]

#: Where the current sensors sit.
Arrangement: TypeAlias = Literal["three-in-line", "two-in-line", "low-side-shunts", "dc-link-shunt", "none"]

#: Currents that the comparators compare with the threshold.
Comparators: TypeAlias = Literal["common", "per-leg"]

class SensorsTable(TypedDict, total=False):
    "The sensors. Deviations are those between specimens, of which each trial draws one."

    #: Time constant with which the capacitors of the current converters follow the sensors between conversions, through the resistance in front of them; 0: at once.
    acquisition: Union[float, str]
    #: Place of the current sensors.
    arrangement: Arrangement
    #: Nominal corner frequency of the current sensors' first-order filters, which the drive knows. 0: no filter.
    bandwidth: Union[float, str]
    #: Largest deviation of each phase's corner frequency beside the common one, uniform, either way.
    bandwidth_mismatch: Union[float, str]
    #: Largest deviation that a specimen's corner frequencies have in common, uniform, either way.
    bandwidth_tolerance: Union[float, str]
    #: Bits of the current converters; 0: nothing is rounded, the range stays.
    bits: Union[float, str]
    #: How long after the begin of each stage the comparators are ignored.
    blanking: Union[float, str]
    #: Corner frequency of that noise; the comparator trips at the first crossing. 0: one value holds for the whole pulse.
    comparator_bandwidth: Union[float, str]
    #: Mean time from the crossing of the threshold to gates and timer, which the drive knows.
    comparator_delay: Union[float, str]
    #: Standard deviation of each comparator's delay.
    comparator_delay_spread: Union[float, str]
    #: Noise of the current at a comparator, rms.
    comparator_noise: Union[float, str]
    #: Standard deviation of the offset of each comparator.
    comparator_offset: Union[float, str]
    #: What the comparators watch: the current in the DC link, or the current of each phase.
    comparators: Comparators
    #: Time from one conversion of a channel to the next one of the same sample, at least twice `skew`.
    conversion: Union[float, str]
    #: Bits of the DC link's converter; 0: nothing is rounded, the range stays.
    dc_link_bits: Union[float, str]
    #: Standard deviation of the DC-link sensor's gain.
    dc_link_gain_error: Union[float, str]
    #: Noise of the DC-link sensor's samples, rms.
    dc_link_noise: Union[float, str]
    #: Standard deviation of the DC-link sensor's offset.
    dc_link_offset: Union[float, str]
    #: Range of the DC link's converter, from zero.
    dc_link_range: Union[float, str]
    #: Standard deviation of each phase's gain.
    gain_error: Union[float, str]
    #: Largest deviation of a trigger's instant, uniform, either way.
    jitter: Union[float, str]
    #: Noise of each sample, rms.
    noise: Union[float, str]
    #: Standard deviation of each phase's offset.
    offset: Union[float, str]
    #: Conversions of each sample, of which a reading is the mean; codes are their sum.
    oversampling: Union[float, str]
    #: Amplitude that an edge of a leg's potential adds to all readings of current.
    pick_up: Union[float, str]
    #: Time constant with which the pick-up of an edge decays.
    pick_up_decay: Union[float, str]
    #: Frequency with which the pick-up of an edge rings.
    pick_up_frequency: Union[float, str]
    #: Range of the current converters, either way.
    range: Union[float, str]
    #: Lowest current of the current converters' range, for amplifiers of one direction; as far below zero as `range` is above it unless set.
    range_low: Union[float, str]
    #: Standard deviation of the resolver that stands for "measured angle" in traces.
    resolver_error: Union[float, str]
    #: Delay of all triggers.
    sample_delay: Union[float, str]
    #: Settling time of a shunt's amplifier that the drive assumes: it does not read a shunt until the dead time and this time have passed since the last request to its leg, to any leg for the shunt in the DC link.
    settle: Union[float, str]
    #: Time from the conversion of phase a to that of phase b, and from b to c.
    skew: Union[float, str]
    #: Slew rate of the shunts' amplifiers: the fastest change of their output, which jumps of the current exceed; 0: no limit.
    slew: Union[float, str]
    #: Corner frequency of the first-order filter behind each divider. 0: no filter.
    terminal_bandwidth: Union[float, str]
    #: Bits of the converters of the terminals' voltages; 0: nothing is rounded, the range stays.
    terminal_bits: Union[float, str]
    #: Standard deviation of the gain of each divider at a terminal.
    terminal_gain_error: Union[float, str]
    #: Resistance of each divider, which loads its terminal: it pulls idle terminals to the negative rail, and discharges their capacitance. 0: it loads nothing.
    terminal_load: Union[float, str]
    #: Noise of each sample of a terminal's voltage, rms.
    terminal_noise: Union[float, str]
    #: Standard deviation of the offset of each divider at a terminal, as a voltage of the terminal.
    terminal_offset: Union[float, str]
    #: Range of the converters of the terminals' voltages, from zero.
    terminal_range: Union[float, str]
    #: Whether the drive reads the voltages of its terminals, each behind a divider to the negative rail.
    terminals: bool
    #: Bits of the converter that sets the threshold. 0: it is exact.
    threshold_bits: Union[float, str]
    #: Upper end of the range of the converter that sets the threshold, from zero.
    threshold_range: Union[float, str]
    #: Tick of the timer that captures when a comparator trips. 0: there is none.
    timer: Union[float, str]
    #: Standard deviation of the clock of that timer.
    timer_error: Union[float, str]
    #: Current at which the comparators switch the drive off for good, as an overcurrent. 0: they do not.
    trip: Union[float, str]

class StopTable(TypedDict, total=False):
    "How narrow the 95 % intervals must be for a point to end; all that are given count. They are looked at when 100 trials are done, and again each time a quarter more are, so that a run ends with the same trial on any machine."

    #: Half the interval of the rms error, as a share of the rms error.
    rms: Union[float, str]
    #: Half the interval of the probability of a wrong pole.
    wrong_poles: Union[float, str]

class Tolerance(TypedDict, total=False):
    "Distribution of a key's value. Widths in per cent are shares of the value in the scenario, others are in its unit."

    #: The middle, where it is not the value in the scenario.
    mean: str
    #: Standard deviation of a normal distribution, such as `"5 %"` or `"2 mA"`.
    normal: str
    #: Standard deviations beyond which a normal distribution is cut off.
    truncated: float
    #: Half the width of a uniform distribution.
    uniform: str

class ScenarioDict(TypedDict, total=False):
    "A scenario: `st.run({...})` takes it, and editors complete its keys."

    #: Keys that are varied, such as `"sensors.noise"`.
    axes: Mapping[str, Axis]
    #: The points of the axes that are run.
    design: DesignTable
    #: The method and its settings.
    detector: DetectorTable
    #: How good drive and sensors are, as far as the tables below do not say otherwise.
    errors: ErrorSet
    #: Faults of motor, inverter, sensors and software, with which the trials run.
    faults: Sequence[FaultTable]
    #: The inverter and its DC link.
    inverter: InverterTable
    #: The angle error whose exceedance is counted, wrong poles included. Without it, 2°.
    limit: Union[float, str]
    #: A built-in motor's name, the path of a data sheet (.toml), or a table: a data sheet in place, or what differs from the motor that its key `base` names.
    motor: MotorSpec
    #: The rotor and what pulls at it.
    rotor: RotorTable
    #: Seed of all random numbers.
    seed: Union[int, str]
    #: The sensors.
    sensors: SensorsTable
    #: How narrow the intervals must be for a point to end before all its trials are done.
    stop_at: StopTable
    #: Keys whose value each trial draws.
    tolerances: Mapping[str, Tolerance]
    #: How many trials, or how many at each point of the axes.
    trials: int
