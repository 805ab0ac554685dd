mod margin;
mod pulsating;
mod rotating;
use standstill_interface::{Dq, Step};

use super::*;
use crate::method::{Pulsating, PulsatingInjectionSettings, Rotating, RotatingInjectionSettings, Sequence};
use crate::nameplate::{Dividers, Place, Sensing};
use crate::parts::polarity::Signature;
use crate::parts::then_pole::State;
use crate::testing::Noise;

fn nameplate(d: f64, q: f64) -> Nameplate<f64> {
    Nameplate {
        rated_current: 7.0,
        resistance: 2.0,
        d_axis_inductance: d,
        q_axis_inductance: q,
        magnet_flux: 0.5,
        signature: Signature::Normal,
        pulse_signature: Signature::Normal,
        polarity_difference: 0.1,
        cross_saturation: 0.0,
        rated_pulse: Nanos::from_micros(350),
        gain_tolerance: 0.0,
        dc_link: 540.0,
        dead_time: Nanos::ZERO,
        delay_mismatch: 0.0,
        carrier_period: Nanos::from_micros(100),
        switch_drop: [0.0; 2],
        diode_drop: [0.0; 2],
        reverse_drop: [0.0; 2],
        sensing: Sensing::default(),
        dividers: Dividers::default(),
    }
}

const MOTORS: [(f64, f64); 2] = [(10e-3, 17e-3), (17e-3, 10e-3)];

fn times(a: AlphaBeta<f64>, b: AlphaBeta<f64>) -> AlphaBeta<f64> {
    AlphaBeta::new(a.alpha * b.alpha - a.beta * b.beta, a.alpha * b.beta + a.beta * b.alpha)
}

fn turn(radians: f64) -> AlphaBeta<f64> {
    AlphaBeta::new(radians.cos(), radians.sin())
}

/// Runs measurements until there is an axis.
fn axis<D: Demodulator<f64>>(
    demodulator: &mut D,
    s: &InjectionSettings<f64>,
    findings: &mut Findings<f64>,
    mut current: impl FnMut(&D, Clock) -> AlphaBeta<f64>,
) -> Result<Angle<f64>, Fault<f64>> {
    loop {
        let mut clock = Clock { period: 0, cycle: s.ramp };
        while clock.cycle < s.ramp + s.cycles {
            let now = current(demodulator, clock);
            demodulator.add(s, clock, now);
            clock.advance(s.periods);
        }
        if let Some(axis) = demodulator.conclude(s, 0.01, 540.0, findings, &mut Margin::new())? {
            return Ok(axis);
        }
    }
}

fn assert_axis(found: Angle<f64>, degrees: f64, most: f64) {
    let off = (2.0 * (found.radians() - degrees.to_radians())).sin().asin() / 2.0;
    let same = (2.0 * (found.radians() - degrees.to_radians())).cos() > 0.0;
    assert!(same && off.abs() < most, "{} {degrees}", found.degrees());
}

#[test]
fn analytic_a_rotating_injection_with_resistance_and_any_delay_is_exact() {
    for (d, q) in MOTORS {
        let s = RotatingInjectionSettings::suited(&nameplate(d, q)).0;
        let omega = s.frequency();
        assert!((omega - core::f64::consts::TAU * 500.0).abs() < 1e-9);
        for degrees in [0.0, 25.0, 88.0, 130.0, 179.0] {
            for late in [0.0, 0.3] {
                // 0 = (R − jωL_Σ) N − jωL_Δ e^{j2θ} P*, from v = R i + L_Σ di/dt + L_Δ e^{j2θ} di*/dt.
                let (sum, difference) = ((d + q) / 2.0, (d - q) / 2.0);
                let p = turn(-1.1) * 1.5;
                let across = times(turn(2.0 * f64::to_radians(degrees)), AlphaBeta::new(p.alpha, -p.beta));
                let across = times(across, AlphaBeta::new(0.0, omega * difference));
                let below = AlphaBeta::new(s.resistance, omega * sum);
                let n = times(across, below) * (1.0 / below.dot(below));
                let mut findings = Findings::default();
                let found = axis(&mut Rotating::new(), &s, &mut findings, |_, clock| {
                    let phase = s.phase(2 * clock.period + 2);
                    let phase = times(phase, turn(-late));
                    times(p, phase) + times(n, AlphaBeta::new(phase.alpha, -phase.beta))
                });
                assert_axis(found.expect("salient"), degrees, 1e-12);
                // N has a noise of 0.01 √(2/3)/√1000 in each component, the axis half of its angle.
                let stated = findings.angle_deviation.expect("stated");
                let expected = 0.01 * (2.0_f64 / 3.0 / 1000.0).sqrt() / n.norm() / 2.0;
                assert!((stated / expected - 1.0).abs() < 1e-9, "{stated} {expected}");
            }
        }
    }
}

#[test]
fn law_the_stated_deviation_of_an_injection_is_the_scatter() {
    let (d, q) = MOTORS[0];
    let s = RotatingInjectionSettings::suited(&nameplate(d, q)).0;
    let mut noise = Noise::new(3);
    let (mut squares, mut stated) = (0.0, 0.0);
    for _ in 0..200 {
        let mut findings = Findings::default();
        let found = axis(&mut Rotating::new(), &s, &mut findings, |_, clock| {
            let phase = s.phase(2 * clock.period + 2);
            // N = j Y1 e^{j2θ}, P = −j Y0, for θ = 20°; no resistance.
            let p = times(AlphaBeta::new(0.0, -1.0), phase);
            let n = times(
                turn(40_f64.to_radians() + core::f64::consts::FRAC_PI_2) * 0.25,
                AlphaBeta::new(phase.alpha, -phase.beta),
            );
            let noise = Abc::new(noise.gauss(), noise.gauss(), noise.gauss()).clarke() * 0.01;
            p + n + noise
        });
        let resistive = (s.resistance / s.frequency() / ((d + q) / 2.0)).atan() / 2.0;
        let off = found.expect("salient").radians() - 20_f64.to_radians() - resistive;
        squares += off * off;
        stated += findings.angle_deviation.expect("stated").powi(2);
    }
    let ratio = (squares / stated).sqrt();
    assert!((0.88..1.12).contains(&ratio), "{ratio}");
}

#[test]
fn law_an_injection_without_answer_or_saliency_has_no_axis() {
    let s = RotatingInjectionSettings::suited(&nameplate(10e-3, 17e-3)).0;
    let mut findings = Findings::default();
    let nothing = axis(&mut Rotating::new(), &s, &mut findings, |_, _| AlphaBeta::new(0.0, 0.0));
    assert!(matches!(nothing, Err(Fault::NoCurrent { .. })));
    let round = axis(&mut Rotating::new(), &s, &mut findings, |_, clock| s.phase(2 * clock.period + 2));
    assert!(matches!(round, Err(Fault::NoSaliency { .. })));
    let s = PulsatingInjectionSettings::suited(&nameplate(10e-3, 17e-3)).0;
    let nothing = axis(&mut Pulsating::new(), &s, &mut findings, |_, _| AlphaBeta::new(0.0, 0.0));
    assert!(matches!(nothing, Err(Fault::NoCurrent { .. })));
    let mean = s.voltage / s.frequency() * s.mean_admittance();
    let round = axis(&mut Pulsating::new(), &s, &mut findings, |demodulator, clock| {
        let along = demodulator.voltage(&s, Clock { period: 0, cycle: 0 });
        along * (mean * s.phase(2 * clock.period + 2).beta / along.norm())
    });
    assert!(matches!(round, Err(Fault::NoSaliency { .. })));
}

#[test]
fn analytic_voltages_turn_grow_and_pulsate_as_told() {
    let s = RotatingInjectionSettings::suited(&nameplate(10e-3, 17e-3)).0;
    let rotating = Rotating::<f64>::new();
    let at = |period: u16, cycle: u16| rotating.voltage(&s, Clock { period, cycle });
    // The middle of a period; 200 of them are the ramp.
    let half = core::f64::consts::TAU / 40.0;
    assert!((at(0, 10) - turn(half) * s.voltage).norm() < 1e-9);
    assert!((at(5, 20) - turn(11.0 * half) * s.voltage).norm() < 1e-9);
    assert!((at(0, 5) - turn(half) * (s.voltage * 100.5 / 200.0)).norm() < 1e-9);
    let s = PulsatingInjectionSettings::suited(&nameplate(10e-3, 17e-3)).0;
    let voltage = Pulsating::<f64>::new().voltage(&s, Clock { period: 3, cycle: 0 });
    let expected = Dq::new(s.voltage * (7.0 * half).cos(), 0.0).unpark(Angle::from_radians(0.0));
    assert!((voltage - expected).norm() < 1e-9);
}

/// Counts its calls.
#[derive(Clone, Debug)]
struct Probe {
    currents: u32,
    most: f64,
    first: Option<Clock>,
}

impl Demodulator<f64> for Probe {
    fn new() -> Self {
        Self { currents: 0, most: 0.0, first: None }
    }

    fn voltage(&self, s: &InjectionSettings<f64>, _: Clock) -> AlphaBeta<f64> {
        AlphaBeta::new(s.voltage, 0.0)
    }

    fn add(&mut self, _: &InjectionSettings<f64>, clock: Clock, current: AlphaBeta<f64>) {
        self.currents += 1;
        self.most = self.most.max(current.norm());
        self.first.get_or_insert(clock);
    }

    fn conclude(
        &mut self,
        _: &InjectionSettings<f64>,
        _: f64,
        _: f64,
        _: &mut Findings<f64>,
        _: &mut Margin<f64>,
    ) -> Result<Option<Angle<f64>>, Fault<f64>> {
        Ok(Some(Angle::from_radians(0.0)))
    }
}

#[test]
fn law_a_measurement_begins_after_its_ramp_and_has_no_offsets() {
    let s = InjectionSettings { ramp: 3, cycles: 4, ..InjectionSettings::suited(&nameplate(10e-3, 17e-3)) };
    let mut detector = Injection::<f64, Probe>::new(InjectionMethod(s, PhantomData)).expect("settings");
    let reading = Reading::measured(Nanos::ZERO, [0.1, -0.05, 0.02], 540.0);
    let mut count = 0;
    let mut periods = 0;
    while !matches!(detector.state, State::Testing(_)) {
        let Ok(Step::Drive(command)) = detector.next(&[reading; 2][..count]) else { panic!("ended") };
        count = usize::try_from(command.sampling.count).expect("few");
        if matches!(detector.state, State::Measuring) {
            assert_eq!(command.duration(), s.modulation.carrier_period);
            periods += 1;
        }
    }
    assert_eq!((periods, detector.measurement.demodulator.currents), (7 * 20, 4 * 20));
    assert_eq!(detector.measurement.demodulator.first, Some(Clock { period: 0, cycle: 3 }));
    assert!(detector.measurement.demodulator.most < 1e-12);
}

/// A drive with one shunt.
fn one_shunt(d: f64, q: f64) -> Nameplate<f64> {
    let sensing = Sensing { place: Place::InLink, settle: Nanos::from_micros(4), ..Sensing::default() };
    Nameplate { sensing, gain_tolerance: 0.005, ..nameplate(d, q) }
}

/// Currents of a motor in the middle of each step of a voltage that is held over it, by its exact exponentials along the axes.
struct Held {
    axis: Angle<f64>,
    inductances: [f64; 2],
    resistance: f64,
    current: [f64; 2],
}

impl Held {
    /// Returns the current in A in the middle of a step of `time` seconds.
    fn step(&mut self, voltage: AlphaBeta<f64>, time: f64) -> AlphaBeta<f64> {
        let voltage = voltage.park(self.axis);
        let mut half = || {
            for (n, volts) in [voltage.d, voltage.q].into_iter().enumerate() {
                let decay = (-self.resistance * time / 2.0 / self.inductances[n]).exp();
                self.current[n] = self.current[n] * decay + volts / self.resistance * (1.0 - decay);
            }
            self.current
        };
        let middle = half();
        half();
        Dq::new(middle[0], middle[1]).unpark(self.axis)
    }
}

/// In the middle of a step, a detector with windows reads the current of a sinusoidal voltage of frequency `ω tan x /
/// x`. With resistance the current bends within a step, by `T²/8 R/L di/dt` in its middle, as if the resistance were
/// larger by tan² x / 2 (5 %).
#[test]
fn analytic_steps_that_are_read_in_their_middle_give_axis_and_inductance() {
    for ((d, q), degrees) in
        MOTORS.into_iter().flat_map(|motor| [25.0, 130.0].map(|degrees| (motor, degrees)))
    {
        // With hardly any resistance, and with 2 Ω.
        for resistance in [1e-6, 2.0] {
            let plate = Nameplate { resistance, ..one_shunt(d, q) };
            let motor = || Held {
                axis: Angle::from_radians(f64::to_radians(degrees)),
                inductances: [d, q],
                resistance,
                current: [0.0; 2],
            };
            let mut findings = Findings::default();
            let s = RotatingInjectionSettings::suited(&plate).0;
            let (mut held, mut rotating) = (motor(), Rotating::new());
            // Long enough for the direct current of its begin to be gone, without ramp.
            for cycle in 0..400 {
                for period in 0..s.periods {
                    let clock = Clock { period, cycle: s.ramp + cycle };
                    let current = held.step(rotating.voltage(&s, clock), s.step().seconds());
                    if resistance < 1.0 || cycle >= 350 {
                        rotating.add(&s, clock, current);
                    }
                }
            }
            // Of 50 cycles; 400 where the current of the begin does not decay, which whole cycles take no notice of.
            let s = InjectionSettings { cycles: if resistance < 1.0 { 400 } else { 50 }, ..s };
            let found = rotating.conclude(&s, 1e-3, 540.0, &mut findings, &mut Margin::new());
            let found = found.expect("salient").expect("one measurement");
            let x = core::f64::consts::PI / f64::from(s.periods);
            let bend = resistance / s.frequency_read() / ((d + q) / 2.0) * x.tan().powi(2) / 4.0;
            assert_axis(found, degrees, 1.1 * bend + 1e-6);
            let off = (2.0 * (found.radians() - degrees.to_radians())).sin().abs() / 2.0;
            assert!(off > 0.9 * bend, "{off} {bend}");
            let expected = 2.0 / 3.0 / s.mean_admittance();
            let inductance = findings.mean_inductance.expect("found");
            // Of resistance the inductance knows nothing: (R/X)²/2.
            let least = if resistance < 1.0 { 1e-6 } else { 2e-3 };
            assert!((inductance / expected - 1.0).abs() < least, "{resistance}: {inductance} {expected}");

            let s = PulsatingInjectionSettings::suited(&plate).0;
            let mut pulsating = Pulsating::new();
            let mut held = motor();
            let found = axis(&mut pulsating, &s, &mut findings, |pulsating, clock| {
                if clock.period == 0 && clock.cycle == s.ramp {
                    // What the begin leaves has decayed.
                    held = motor();
                    for period in (0..30).flat_map(|_| 0..s.periods) {
                        held.step(pulsating.voltage(&s, Clock { period, cycle: 0 }), s.step().seconds());
                    }
                }
                held.step(pulsating.voltage(&s, clock), s.step().seconds())
            });
            assert_axis(found.expect("salient"), degrees, f64::to_radians(1e-2));
        }
    }
}

/// The gain of the one amplifier is common to all currents: it is no saliency, however large it is.
#[test]
fn law_one_shunt_has_one_gain() {
    let (d, q) = (10e-3, 10.6e-3);
    for (plate, found) in [(one_shunt(d, q), true), (nameplate(d, q), false)] {
        // The saliency is 2.9 %; unequal gains of three sensors may make 4 √(1/6) 5 % of it.
        let s = InjectionSettings {
            gain_tolerance: 0.05,
            least_saliency: 0.01,
            ..RotatingInjectionSettings::suited(&plate).0
        };
        let gain = 1.05;
        let mut findings = Findings::default();
        let turned = axis(&mut Rotating::new(), &s, &mut findings, |_, clock| {
            let phase = s.phase_read(clock);
            let n = AlphaBeta::new(phase.alpha, -phase.beta) * (0.6 / 20.6);
            (phase + n) * gain
        });
        assert_eq!(turned.is_ok(), found, "{turned:?}");
    }
    let plate = one_shunt(10e-3, 10e-3 + 1e-9);
    let s = |gain_tolerance| InjectionSettings {
        gain_tolerance,
        least_saliency: 1e-3,
        ..PulsatingInjectionSettings::suited(&plate).0
    };
    let round = |s: &InjectionSettings<f64>, gain: f64| {
        axis(&mut Pulsating::new(), s, &mut Findings::default(), |demodulator, clock| {
            let along = demodulator.voltage(s, Clock { period: 0, cycle: 0 });
            let mean = s.voltage / s.frequency_read() * s.mean_admittance();
            along * (gain * mean * s.phase_read(clock).beta / along.norm())
        })
    };
    for (tolerance, gain) in [(0.01, 1.03), (0.001, 1.03), (0.0, 1.5)] {
        let round = round(&s(tolerance), gain);
        assert!(
            matches!(round, Err(Fault::NoSaliency { ratio, .. }) if ratio < 1e-9),
            "{tolerance} {gain}: {round:?}"
        );
    }
}

/// If the amplifier takes long to settle, a smaller voltage leaves room for its windows; if it takes too long, the
/// error names the key.
#[test]
fn law_the_suited_voltage_leaves_room_for_the_windows() {
    let suited = |micros| {
        let plate = one_shunt(10e-3, 17e-3);
        let sensing = Sensing { settle: Nanos::from_micros(micros), ..plate.sensing };
        RotatingInjectionSettings::suited(&Nameplate { sensing, dead_time: Nanos::from_micros(2), ..plate }).0
    };
    let plain = RotatingInjectionSettings::suited(&nameplate(10e-3, 17e-3)).0.voltage;
    let [roomy, tight, none] = [4, 10, 12].map(suited);
    assert!(roomy.check().is_ok() && roomy.voltage.to_bits() == plain.to_bits());
    assert!(tight.check().is_ok() && tight.voltage < 0.95 * plain, "{}", tight.voltage);
    // All of the room is used.
    assert!(InjectionSettings { voltage: tight.voltage * 1.001, ..tight }.check().is_err());
    let refused = none.check().expect_err("no room");
    assert!(refused.setting == "window" && refused.needed.contains("sensors.settle"), "{refused}");
}
