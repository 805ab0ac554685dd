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

#: A number or a text; used only in the schema.
NumberOrText: TypeAlias = Union[float, str]

#: A range of numbers.
AxisTable = TypedDict("AxisTable", {
    "from": NumberOrText,  # The first value, such as `"0 mA"` or `5`.
    "log": bool,  # True for a geometric range: neighbouring values have the same ratio instead of the same difference.
    "points": int,  # Number of values of a grid, both ends included. Other designs spread all their points over the range.
    "to": NumberOrText,  # The last value, in a unit of the same dimension.
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
Checks: TypeAlias = Union[bool, Sequence[Literal["link", "sensors", "inductance", "both-ways", "contact", "codes", "turning", "saliency"]]]

#: A setting of a library: a text, a number, or true or false.
Scalar: TypeAlias = Union[str, float, bool]

#: The methods.
MethodName: TypeAlias = Literal["line-inductance", "line-inductance-fast", "subdivision", "hfi-rotating", "hfi-pulsating", "dc-alignment", "bipolar", "maximum-likelihood", "maximum-likelihood-adaptive", "open-terminal", "six-pulse"]

#: The rule by which the pole is decided, in methods that find the axis first and then run a separate polarity test.
PoleRule: TypeAlias = Literal["two-vectors", "sequential"]

#: The one of two opposite voltage vectors along the d-axis that raises the larger current: a property of the motor's magnetics, and the one thing about the poles that no measurement at standstill can tell.
Signature: TypeAlias = Literal["normal", "inverted", "none"]

class DetectorTable(TypedDict, total=False):
    "The method and its settings. A setting without a value is computed for the motor; one that the method does not have is an error."

    #: Corner frequency of the current sensors' filters as their data sheet states it; 0: no filter.
    bandwidth: Union[float, str]
    #: With --isolate, the longest time that a call of the library may take on the clock. Without it, 1 s.
    call_timeout: Union[float, str]
    #: Checks of the readings for faulty parts and for a rotor that turns: true for all, false for none, or a list.
    checks: Checks
    #: Whether the detector first compares the dividers at the terminals, with all legs high.
    comparison: bool
    #: Whether an injection compensates dead time and drops.
    compensation: bool
    #: Settings of the library, handed over as lines KEY=VALUE.
    config: Mapping[str, Scalar]
    #: Dead time that the detector assumes.
    dead_time: Union[float, str]
    #: Standard deviation of the angle at which an adaptive method stops.
    deviation: Union[float, str]
    #: Standard deviation of the gains of the current sensors, or of the dividers at the terminals, that the detector assumes; 0: equal.
    gain_tolerance: Union[float, str]
    #: Saliency |L_B|/L_A below which the detector gives no angle.
    least_saliency: Union[float, str]
    #: Path of a shared library that is the detector in place of a method: see docs/firmware.md.
    library: str
    #: The method.
    method: MethodName
    #: Order of the six pulses: true if each is followed by the opposite one, false if by the next one around the circle.
    pairs: bool
    #: Time for which all switches are open after each of the six pulses, as a share of the longest pulse. After less than about two thirds, a current remains in the next pulse, which shifts axis and pole.
    pause: Union[float, str]
    #: The rule by which poles are decided.
    polarity: PoleRule
    #: Largest allowed probability of a wrong pole.
    pole_error: Union[float, str]
    #: Length of the line pulses.
    pulse: Union[float, str]
    #: Python class that is the detector in place of a method, as `module.Class@digest`. `standstill.run(..., detector=Class)` writes it into the record of its run, and runs it: see docs/python.md.
    python: str
    #: Time for which all switches are open after each line pulse of methods that pulse in both directions, as a share of the pulse; the current needs a little less than the pulse to decay.
    rest: Union[float, str]
    #: Number of rounds of pulses through all lines, or of pulses per line.
    rounds: Union[float, str]
    #: Width of the sectors in which six pulses give the angle: 30° or 60°; 0: an interpolated angle.
    sector: Union[float, str]
    #: The pole that the detector assumes to draw more current.
    signature: Signature
    #: Current at which each of the six pulses ends. Without a timer, the pulse is as long as this current takes on the data sheet's motor.
    threshold: Union[float, str]
    #: Longest time of a detection, in simulated time: a longer one fails. Default: 20 s.
    time_limit: Union[float, str]
    #: True if the six pulses last until a comparator trips and their times are compared, false if they last a fixed time and their currents are compared.
    timed: bool
    #: Current of a polarity test's vectors.
    vector_current: Union[float, str]
    #: Amplitude of an injected voltage.
    voltage: Union[float, str]
    #: Smallest time of each of the two vectors of a carrier period in which an injection samples a shunt in the DC link. Edges are shifted to give this time, and by the opposite in the next period.
    window: Union[float, str]

#: Set of errors of drive and sensors.
ErrorSet: TypeAlias = Literal["none", "noise", "default", "harsh", "field"]

#: The phase, leg or sensor at which a fault is.
FaultPlace: TypeAlias = Literal["a", "b", "c", "any"]

#: A value, or the smallest and the largest of those that trials draw.
Between: TypeAlias = Union[Union[str, float], Sequence[Union[str, float]]]

#: A failure mode: the part that is broken, and how.
FaultMode: TypeAlias = Literal["phase-open", "contact-resistance", "turns-shorted", "terminals-swapped", "terminals-turned", "magnet-weak", "sheet-signature", "sheet-inductance", "sheet-resistance", "upper-switch-open", "lower-switch-open", "leg-off", "dead-time-long", "link-capacitor-aged", "supply-weak", "supply-limited", "current-dead", "current-frozen", "current-stuck", "current-bit", "current-gain", "current-offset", "current-sign", "currents-swapped", "current-slow", "reference-drift", "sample-late", "link-gain", "link-stuck", "comparator-stuck", "timer-off", "command-late", "duty-limited", "sample-lost"]

class FaultTable(TypedDict, total=False):
    "A fault of motor, inverter, sensors or software."

    #: The phase, leg or sensor; without it, each trial draws one.
    at: FaultPlace
    #: Number of the detection's command, from 1, from whose start `onset` counts, or a list of two between which each trial draws one.
    command: Between
    #: Coupling of the turns of `turns-shorted` with their phase, or a list of two between which each trial draws one. Default: 0.9.
    coupling: Between
    #: Time after which the fault ends, as with an intermittent contact. Without this key, it does not end.
    lasts: Union[float, str]
    #: The size in the unit of the mode, such as `"2 Ω"`, or a list of two sizes between which each trial draws one.
    magnitude: Between
    #: The failure mode.
    mode: FaultMode
    #: Time after the start of the detection, or of `command`, at which the fault begins. Without both keys, it exists before the detection.
    onset: Between
    #: Resistance in the path of `turns-shorted`, or a list of two between which each trial draws one. Default: 0 Ω.
    resistance: Between

#: Type of the switches.
DeviceKind: TypeAlias = Literal["igbt", "mosfet"]

#: What an idle leg (both switches off, no current) may do.
OpenLeg: TypeAlias = Literal["diodes", "open"]

class InverterTable(TypedDict, total=False):
    "The inverter and its DC link."

    #: Capacitance of the DC link; 0: none, the link has the source's voltage at any current.
    capacitance: Union[float, str]
    #: Frequency of the PWM carrier.
    carrier: Union[float, str]
    #: Resistance of a MOSFET's channel, which conducts both ways while its gate is on.
    channel_resistance: Union[float, str]
    #: Voltage of the DC link. Default: the nominal one of the motor's data sheet.
    dc_link: Union[float, str]
    #: Dead time.
    dead_time: Union[float, str]
    #: Standard deviation of the legs' switching delays.
    delay_mismatch: Union[float, str]
    #: Kind of the switches. Default: MOSFETs if the motor's nominal DC-link voltage is at most 60 V, else IGBTs.
    devices: DeviceKind
    #: Voltage across a conducting diode at no current.
    diode_drop: Union[float, str]
    #: Slope of the voltage across a conducting diode over its current.
    diode_resistance: Union[float, str]
    #: Behaviour of a leg with both switches off. If terminals have a capacitance, its diodes conduct in every error set.
    open_leg: OpenLeg
    #: Amplitude of the DC link's ripple, a share of its voltage.
    ripple: Union[float, str]
    #: Frequency of the DC link's ripple.
    ripple_frequency: Union[float, str]
    #: Depth of a sag of the source, a share of the voltage: a smooth trough, deepest in its middle. 0: none.
    sag_depth: Union[float, str]
    #: Duration of the sag.
    sag_duration: Union[float, str]
    #: Start of the sag, after the start of the detection. Default: 0.
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

#: Magnetisation of the stator's iron at the start, for motors whose data sheet has a `[hysteresis]`.
Memory: TypeAlias = Literal["virgin", "former"]

#: Motion of the rotor.
Rotor: TypeAlias = Literal["locked", "free", "brake", "driven"]

class RotorTable(TypedDict, total=False):
    "The rotor: its motion, load and temperatures."

    #: Constant acceleration of the shaft of a rotor that is "driven"; `speed` is its speed at the start.
    acceleration: Union[float, str]
    #: Electrical angle at the start, the same in all trials. Without it, each trial draws its angle from a uniform distribution.
    angle: Union[float, str]
    #: Torque that a load exerts against forward motion, also at standstill.
    load: Union[float, str]
    #: Temperature of the magnets. The drive does not know it.
    magnet_temperature: Union[float, str]
    #: Magnetisation of the stator's iron at the start, of a motor whose data sheet has a `[hysteresis]`.
    memory: Memory
    #: Speed of the shaft at the start, negative if backwards, of a rotor that coasts ("free") or is "driven".
    speed: Union[float, str]
    #: Motion of the rotor: held, free, or free within the play of a brake.
    state: Rotor
    #: Temperature of the winding. The drive does not know it.
    winding_temperature: Union[float, str]

#: Arrangement of a drive's current sensors: where they measure.
Arrangement: TypeAlias = Literal["three-in-line", "two-in-line", "low-side-shunts", "dc-link-shunt", "none"]

#: Arrangement of a drive's comparators: the currents that they compare with the threshold.
Comparators: TypeAlias = Literal["common", "per-leg"]

class SensorsTable(TypedDict, total=False):
    "The sensors. Deviations are between specimens; each trial draws one specimen."

    #: Time constant with which the sampling capacitors of the current converters follow the sensors between conversions, through the resistance in front of them; 0: they follow at once.
    acquisition: Union[float, str]
    #: Place of the current sensors.
    arrangement: Arrangement
    #: Nominal corner frequency of the current sensors' first-order filters, which the drive knows. 0: no filter.
    bandwidth: Union[float, str]
    #: Largest deviation of each phase's corner frequency in addition to the common one, either way; uniform distribution.
    bandwidth_mismatch: Union[float, str]
    #: Largest deviation that all corner frequencies of a specimen have in common, either way; uniform distribution.
    bandwidth_tolerance: Union[float, str]
    #: Bits of the current converters; 0: readings are limited to the range, but not rounded.
    bits: Union[float, str]
    #: Time after the start of each stage for which the comparators are ignored.
    blanking: Union[float, str]
    #: Corner frequency of the noise at a comparator, which trips at the first crossing. 0: the noise has one value for the whole pulse.
    comparator_bandwidth: Union[float, str]
    #: Mean delay from the crossing of the threshold to gates and timer, which the drive knows.
    comparator_delay: Union[float, str]
    #: Standard deviation of each comparator's delay.
    comparator_delay_spread: Union[float, str]
    #: Noise of the current at a comparator, rms.
    comparator_noise: Union[float, str]
    #: Standard deviation of the offset of each comparator.
    comparator_offset: Union[float, str]
    #: Current that the comparators watch: that of the DC link, or that of each phase.
    comparators: Comparators
    #: Time from one conversion of a channel to the next one of the same sample, at least twice `skew`.
    conversion: Union[float, str]
    #: Bits of the DC link's converter; 0: readings are limited to the range, but not rounded.
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
    #: Largest deviation of a trigger's instant, either way; uniform distribution.
    jitter: Union[float, str]
    #: Noise of each sample, rms.
    noise: Union[float, str]
    #: Standard deviation of each phase's offset.
    offset: Union[float, str]
    #: Number of conversions per sample: a reading is their mean, a code their sum.
    oversampling: Union[float, str]
    #: Amplitude that an edge of a leg's potential adds to all readings of current.
    pick_up: Union[float, str]
    #: Time constant with which the pick-up of an edge decays.
    pick_up_decay: Union[float, str]
    #: Frequency with which the pick-up of an edge rings.
    pick_up_frequency: Union[float, str]
    #: Largest current of the current converters' range.
    range: Union[float, str]
    #: Lowest current of the current converters' range, for amplifiers of one direction. Default: minus `range`.
    range_low: Union[float, str]
    #: Standard deviation of the resolver whose reading is the "measured angle" in traces.
    resolver_error: Union[float, str]
    #: Delay of all triggers.
    sample_delay: Union[float, str]
    #: Settling time of a shunt's amplifier that the drive assumes: it does not read a shunt until the dead time and this time have passed since the last request to its leg, to any leg for the shunt in the DC link.
    settle: Union[float, str]
    #: Time from the conversion of phase a to that of phase b, and from b to c.
    skew: Union[float, str]
    #: Slew rate of the shunts' amplifiers: the fastest change of their output, as a current per time; 0: no limit.
    slew: Union[float, str]
    #: Corner frequency of the first-order filter behind each divider. 0: no filter.
    terminal_bandwidth: Union[float, str]
    #: Bits of the converters of the terminals' voltages; 0: readings are limited to the range, but not rounded.
    terminal_bits: Union[float, str]
    #: Standard deviation of the gain of each divider at a terminal.
    terminal_gain_error: Union[float, str]
    #: Resistance of each divider, which loads its terminal: it pulls idle terminals to the negative rail and discharges their capacitance. 0: no load.
    terminal_load: Union[float, str]
    #: Noise of each sample of a terminal's voltage, rms.
    terminal_noise: Union[float, str]
    #: Standard deviation of the offset of each divider at a terminal, as a voltage of the terminal.
    terminal_offset: Union[float, str]
    #: Range of the converters of the terminals' voltages, from zero.
    terminal_range: Union[float, str]
    #: Whether the drive reads the voltages of its terminals, each behind a divider to the negative rail.
    terminals: bool
    #: Bits of the converter that sets the threshold. 0: the threshold is exact.
    threshold_bits: Union[float, str]
    #: Upper end of the range of the converter that sets the threshold, from zero.
    threshold_range: Union[float, str]
    #: Tick of the timer that captures when a comparator trips. 0: no timer.
    timer: Union[float, str]
    #: Standard deviation of the frequency of that timer's clock, as a share.
    timer_error: Union[float, str]
    #: Current at which the comparators switch the drive off for the rest of the run, as an overcurrent trip. 0: no trip.
    trip: Union[float, str]

class StopTable(TypedDict, total=False):
    "Widths of the 95 % intervals at which a point ends; every key that is set must be met. They are checked after 100 trials and after each further quarter of the trials, so that a run ends with the same trial on any machine."

    #: Half the interval of the rms error, as a share of the rms error.
    rms: Union[float, str]
    #: Half the interval of the probability of a wrong pole.
    wrong_poles: Union[float, str]

class Tolerance(TypedDict, total=False):
    "Distribution from which each trial draws a key's value. A width in per cent is a share of the mean, or percentage points if the mean is in per cent. Any other width has a unit of the key's quantity."

    #: Mean of the distribution. Default: the value in the scenario.
    mean: str
    #: Standard deviation of a normal distribution, such as `"5 %"` or `"2 mA"`.
    normal: str
    #: Number of standard deviations at which a normal distribution is truncated.
    truncated: float
    #: Half the width of a uniform distribution, such as `"5 %"` or `"2 mA"`.
    uniform: str

class ScenarioDict(TypedDict, total=False):
    "A scenario: `st.run({...})` takes it, and editors complete its keys."

    #: Keys that are varied, such as `"sensors.noise"`.
    axes: Mapping[str, Axis]
    #: The points of the axes that are run.
    design: DesignTable
    #: The method and its settings.
    detector: DetectorTable
    #: Set of errors of drive and sensors, for all keys that the tables below do not set.
    errors: ErrorSet
    #: Faults of motor, inverter, sensors and software, with which the trials run.
    faults: Sequence[FaultTable]
    #: The inverter and its DC link.
    inverter: InverterTable
    #: Angle error in degrees: trials with a larger error, wrong poles included, are counted. Default: 2°.
    limit: Union[float, str]
    #: A built-in motor's name, the path of a data sheet (.toml), or a table: a data sheet in place, or only the values that differ from those of the motor that its key `base` names.
    motor: MotorSpec
    #: The rotor: its motion, load and temperatures.
    rotor: RotorTable
    #: Seed of all random numbers.
    seed: Union[int, str]
    #: The sensors.
    sensors: SensorsTable
    #: Widths of the 95 % intervals at which a point ends before all its trials are done.
    stop_at: StopTable
    #: Keys whose value each trial draws from a distribution.
    tolerances: Mapping[str, Tolerance]
    #: Number of trials, at each point if there are axes.
    trials: int
