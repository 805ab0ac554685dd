//! Closed forms of single pulses: results that follow by hand from a circuit's equations are compared with the simulation of the same
//! circuit.

use standstill_interface::{Abc, Command, Leg, Nanos, Phase, Sampling, Stage};
use standstill_inverter::{Bridge, Conduction, DcLink, Devices, GateTiming, Inverter, OpenLeg};
use standstill_numeric::{cos, exp, exp_m1, ln, sin};
use standstill_plant::{Core, EddyBranch, Linear, MagneticCircuit, Motor, Winding};
use standstill_sim::{Case, ComparatorSettings, Event, SensorSettings, Sensors, TerminalSensor, Tolerance};

use super::{Witness, WitnessError, motor};
use crate::bound::replay::{TERMINAL, TIME, replay, watched};

/// Voltage of the DC link in V.
pub(super) const LINK: f64 = 550.0;
/// Rotor angle in degrees during line pulses.
const ANGLE_DEG: f64 = 43.2;

/// Returns a motor without saturation. L_A is 9.2 mH, L_B is −2.1 mH, and the resistance of a phase is 1 Ω.
///
/// # Errors
/// There is no such built-in motor.
pub fn line_motor() -> Result<Motor, WitnessError> {
    let winding = Winding { mean_inductance: 9.2e-3, saliency: -2.1e-3, leakage: 0.0 };
    let core = Core::Linear(Linear::from_winding(&winding, 0.45));
    let magnetics = MagneticCircuit::new(core).map_err(|error| WitnessError::Setting(error.to_string()))?;
    Ok(Motor { resistance: 1.0, winding, magnetics, ..motor("paper-5k5")? })
}

/// Makes an inverter of ideal switches without dead time on a stiff link of 550 V.
fn inverter(open_leg: OpenLeg) -> Inverter {
    Inverter {
        bridge: Bridge { open_leg, ..Bridge::default() },
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(LINK),
        carrier_period: Nanos::from_micros(100),
    }
}

pub(super) fn case(motor: &Motor, open_leg: OpenLeg, angle_deg: f64) -> Case<'_> {
    Case { start_angle: angle_deg.to_radians(), ..Case::new(motor, inverter(open_leg)) }
}

/// Returns a pulse of 80 µs on the line from a to b, sampled at its end.
fn pulse() -> Command<f64> {
    let pulse = Nanos::from_micros(80);
    Command::hold(Stage::line(Phase::A, Phase::B, pulse), Sampling::once(pulse))
}

/// Checks the current in A at the end of a line pulse of 80 µs. The rotor is at rest, and the third leg is open or conducts through its
/// diodes. The closed form is U/2R (1 − exp(−2R t/L)).
///
/// # Errors
/// A run could not continue.
pub fn line_pulse(open_leg: OpenLeg) -> Result<Witness, WitnessError> {
    let motor = line_motor()?;
    let line = motor.winding.line_inductances(ANGLE_DEG.to_radians())[Phase::A];
    let known = -LINK / 2.0 * exp_m1(-2.0 * 80e-6 / line);
    let here = replay(&case(&motor, open_leg, ANGLE_DEG), &[pulse()])?.value[0][0];
    let third = if open_leg == OpenLeg::Open { "open" } else { "with diodes" };
    Ok(Witness::closed(
        format!("current of a line pulse from rest, third leg {third}"),
        [known, here],
        1e-9 * known,
        "A",
    ))
}

/// Checks the time in s at which the diodes have brought the current of a line pulse to zero after all gates were turned off. The known
/// time t after the turn-off fulfils (i + U/2R) exp(−2R t/L) = U/2R.
///
/// # Errors
/// A run could not continue.
pub fn gates_off() -> Result<Witness, WitnessError> {
    let motor = line_motor()?;
    let line = motor.winding.line_inductances(ANGLE_DEG.to_radians())[Phase::A];
    let peak = -LINK / 2.0 * exp_m1(-2.0 * 80e-6 / line);
    let known = 80e-6 + ln(peak / (LINK / 2.0) + 1.0) * line / 2.0;
    let off = Stage::off(Nanos::from_micros(2320));
    let command =
        Command::sequence(Stage::line(Phase::A, Phase::B, Nanos::from_micros(80)), off, Sampling::NONE);
    let trace = watched(&case(&motor, OpenLeg::Diodes, ANGLE_DEG), &[command]);
    let blocked = trace.events.iter().find_map(|(time, event)| {
        (*time > 80e-6 && matches!(event, Event::Conduction(Phase::A, Conduction::Blocked))).then_some(*time)
    });
    let figures = [known, blocked.unwrap_or(f64::NAN)];
    Ok(Witness::closed("time at which gates that are off have ended the current", figures, 1e-10, "s"))
}

/// Checks the current in A after a voltage step in a motor with eddy currents and without resistance. The closed form is V t/L + G V τ (1 −
/// exp(−t/τ)).
///
/// # Errors
/// A run could not continue.
pub fn eddy_step() -> Result<Witness, WitnessError> {
    let (tau, depth, time) = (50e-6, 0.2, 300e-6);
    let mut motor = motor("paper-5k5")?.linearised();
    motor.resistance = 0.0;
    let branch = EddyBranch { time_constant: tau, d_depth: depth, q_depth: 0.0 };
    motor.magnetics = motor.magnetics.clone().with_eddy_currents(Some(branch));
    let inductance = motor.winding.d_axis_inductance();
    let voltage = LINK * 2.0 / 3.0;
    let known = voltage / inductance * (time - depth / (1.0 - depth) * tau * exp_m1(-time / tau));
    let mut case = case(&motor, OpenLeg::Diodes, 0.0);
    case.tolerance = Tolerance { flux: 1e-13 };
    let end = Nanos::from_micros(300);
    let stage = Stage { legs: Abc::new(Leg::High, Leg::Low, Leg::Low), duration: end };
    let here = replay(&case, &[Command::hold(stage, Sampling::once(end))])?.value[0][0];
    Ok(Witness::closed("current of a voltage step with eddy currents", [known, here], 1e-9 * known, "A"))
}

/// Checks the time in s at which a comparator trips at 8 A while a voltage vector is applied. The known time is the root of a sum of two
/// exponentials, found by bisection to the last bit.
///
/// # Errors
/// A run could not continue.
pub fn threshold() -> Result<Witness, WitnessError> {
    let (angle, level) = (1.1, 8.0);
    let motor = motor("paper-5k5")?.linearised();
    let current = |time: f64| {
        let share = |inductance: f64, part: f64| {
            let rate = -motor.resistance * time / inductance;
            -part * part * (2.0 / 3.0) * LINK / motor.resistance * exp_m1(rate)
        };
        share(motor.winding.d_axis_inductance(), cos(angle))
            + share(motor.winding.q_axis_inductance(), sin(angle))
    };
    let (mut low, mut high) = (0.0, 400e-6);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if current(middle) < level { &mut low } else { &mut high }) = middle;
    }
    let tick = 1e-12;
    let comparator = ComparatorSettings { timer: tick, ..SensorSettings::IDEAL.comparator };
    let settings = SensorSettings { comparator, ..SensorSettings::IDEAL };
    let case = Case {
        sensors: Sensors::nominal(settings),
        start_angle: angle,
        ..Case::new(&motor, inverter(OpenLeg::Open))
    };
    let stage = Stage { legs: Abc::new(Leg::High, Leg::Low, Leg::Low), duration: Nanos::from_micros(400) };
    let off = Stage::off(Nanos::from_micros(500));
    let read = replay(&case, &[Command::until(level, stage, off, Sampling::once(Nanos::ZERO))])?;
    let here = read.value.first().map_or(f64::NAN, |sample| sample[TIME]);
    Ok(Witness::closed("time of a comparator's trip at 8 A", [low, here], 50e-12, "s"))
}

/// Checks the voltage in V of the open terminal 100 µs after the start of a line pulse. The closed form is U/2 + r U exp(−2R t/L), where r
/// follows from the saliency and the rotor angle.
///
/// # Errors
/// A run could not continue.
pub fn open_terminal() -> Result<Witness, WitnessError> {
    let (angle, time) = (0.55_f64, Nanos::from_micros(100));
    let motor = motor("paper-5k5")?.linearised();
    let k = motor.winding.saliency / motor.winding.mean_inductance;
    let twice = 2.0 * (angle - (-30.0_f64).to_radians());
    let lines = 1.0 + k * cos(twice);
    let r = -(3.0_f64.sqrt() / 2.0) * k * sin(twice) / lines;
    let rate = 2.0 * motor.resistance / (3.0 * motor.winding.mean_inductance * lines);
    let known = LINK / 2.0 + r * LINK * exp(-rate * time.seconds());
    let settings = SensorSettings { terminal: Some(TerminalSensor::IDEAL), ..SensorSettings::IDEAL };
    let mut case = case(&motor, OpenLeg::Open, 0.0);
    (case.start_angle, case.sensors, case.tolerance) =
        (angle, Sensors::nominal(settings), Tolerance { flux: 1e-12 });
    let stage = Stage::line(Phase::A, Phase::B, Nanos::from_micros(200));
    let here = replay(&case, &[Command::hold(stage, Sampling::once(time))])?.value[0][TERMINAL + 2];
    Ok(Witness::closed("voltage of the open terminal during a line pulse", [known, here], 1e-6, "V"))
}

/// Checks the current of phase a, in A, at the end of a voltage vector of t = 80 µs along the d axis of a locked rotor. The dead time of
/// t_d = 2 µs delays the turn-on of the legs. Without resistance the closed form is i = 2/3 U (t − t_d)/L_d, with the link's voltage U.
///
/// # Errors
/// A run could not continue.
pub fn dead_time() -> Result<Witness, WitnessError> {
    let (dead, on) = (2e-6, 80e-6);
    let mut motor = motor("paper-5k5")?.linearised();
    motor.resistance = 0.0;
    let inductance = motor.winding.d_axis_inductance();
    let known = LINK * (2.0 / 3.0) * (on - dead) / inductance;
    let mut inverter = inverter(OpenLeg::Diodes);
    inverter.gates = [GateTiming { dead_time: Nanos::from_micros(2), ..GateTiming::default() }; 3];
    let low = Stage { legs: Abc::new(Leg::Low, Leg::Low, Leg::Low), duration: Nanos::from_micros(20) };
    let vector = Stage { legs: Abc::new(Leg::High, Leg::Low, Leg::Low), duration: Nanos::from_micros(80) };
    let command = Command::sequence(low, vector, Sampling::once(Nanos::from_micros(100)));
    let here = replay(&Case::new(&motor, inverter), &[command])?.value[0][0];
    Ok(Witness::closed("current of a pulse that the dead time shortens", [known, here], 1e-9 * known, "A"))
}

/// Peaks in A of three line pulses of 80 µs from a to b that ngspice computed, each followed by 2320 µs in which the lower switches short
/// the line.
const NGSPICE_PEAKS: [f64; 3] = [1.336_48, 2.488_85, 3.484_52];

/// Current in A that ngspice found in the diode of the third leg 7.185 ms after the begin (`tests/cross/ngspice/slow_ab_043_ideal.csv`).
const NGSPICE_IDLE_LEG: f64 = 0.075_509;

/// Drop in V of the diodes of ngspice's netlist, which are nearly ideal.
const JUNCTION: f64 = 2.1e-3;

/// Checks currents in A of three line pulses, with low-side freewheel between them, against ngspice's ([`NGSPICE_PEAKS`]). Switches and
/// diodes have 10 mΩ and the drop of the netlist's diodes. `open_leg` is the behaviour of the third leg.
///
/// # Errors
/// A run could not continue.
pub(super) fn ngspice(open_leg: OpenLeg) -> Result<Vec<Witness>, WitnessError> {
    let motor = line_motor()?;
    let mut inverter = inverter(open_leg);
    inverter.bridge.devices = Devices {
        switch_drop: JUNCTION,
        switch_resistance: 10e-3,
        diode_drop: JUNCTION,
        diode_resistance: 10e-3,
        ..Devices::default()
    };
    let end = Nanos::from_micros(80);
    let freewheel = Stage::freewheel(Phase::A, Phase::B, Nanos::from_micros(2320));
    let twice = Sampling { first: end, interval: Nanos::from_micros(2305), count: 2 };
    let pulse = Command::sequence(Stage::line(Phase::A, Phase::B, end), freewheel, twice);
    let case = Case { start_angle: ANGLE_DEG.to_radians(), ..Case::new(&motor, inverter) };
    let read = replay(&case, &[pulse; 3])?.value;
    let at = |sample: usize, phase: usize| read.get(sample).map_or(f64::NAN, |of| of[phase]);
    let witness =
        |claim: String, figures, tolerance| Witness::number(claim, "ngspice, kept", figures, tolerance, "A");
    let mut found: Vec<Witness> = (NGSPICE_PEAKS.into_iter().enumerate())
        .map(|(k, known)| {
            let claim = format!("current of line pulse {} of three with freewheel between them", k + 1);
            witness(claim, [known, at(2 * k, 0)], 5e-4 * known)
        })
        .collect();
    let claim = "current of the third leg's diode in the last of these freewheels".to_owned();
    found.push(witness(claim, [NGSPICE_IDLE_LEG, at(5, 2)], 1e-4 * NGSPICE_PEAKS[2]));
    Ok(found)
}

pub(super) fn all() -> Result<Vec<Witness>, WitnessError> {
    let mut found = vec![
        line_pulse(OpenLeg::Open)?,
        line_pulse(OpenLeg::Diodes)?,
        gates_off()?,
        dead_time()?,
        eddy_step()?,
        threshold()?,
        open_terminal()?,
    ];
    found.extend(ngspice(OpenLeg::Diodes)?);
    Ok(found)
}
