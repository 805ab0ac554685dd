//! An oscilloscope of eight bits, on pulses that ngspice and SciPy computed (`tests/cross`).

#[allow(dead_code, reason = "not each user has a use for all of it")]
pub mod mosfet;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use standstill_fit::record::Record;
use standstill_fit::{DeviceKind, Devices, Estimate, Fit, MOST_USED, Start, fit};
use standstill_plant::{Algebraic, Core, IronBridge, MagneticCircuit, Magnetics, Motor, built_in};
use standstill_sim::{Purpose, Streams};

/// Pulses without any channel's error.
#[derive(Clone)]
pub struct Pulses {
    /// Time in s, from one row to the next alike, phase currents and the current from the DC link into the bridge in A; NaN where a
    /// reference has none.
    pub rows: Vec<[f64; 5]>,
    /// When the legs are asked for something else, in s, and for what.
    legs: Vec<(f64, [&'static str; 3])>,
    /// What the fit must find.
    pub truth: Vec<(&'static str, f64)>,
    /// Falls of L_d along +d and −d and of L_q along q at a current in A.
    pub falls: Option<Falls>,
    /// Voltage of the DC link in V.
    pub link: f64,
}

/// Falls along +d and −d and along q at a current in A.
pub type Falls = std::sync::Arc<dyn Fn(f64) -> [f64; 3] + Send + Sync>;

/// The channels of a scope.
#[derive(Clone, Copy, Debug)]
pub struct Scope {
    /// From one sample to the next, in s.
    pub interval: f64,
    /// Full scale of the currents in A, either way.
    pub range: f64,
    /// Noise before the converter, in steps of it.
    pub noise: f64,
    /// Gains of the channels.
    pub gain: [f64; 3],
    /// Time in s by which the channels are late.
    pub delay: f64,
    /// Time constant of the probes in s.
    pub lag: f64,
    /// Codes from zero to full scale.
    pub codes: f64,
    /// One shunt in the DC link in place of the phases' channels.
    pub shunt: bool,
}

/// Between two samples in s: as the drive's timer counts. Every edge lies at the same place between two samples.
pub const DRIVES_BEAT: f64 = 1e-6;

/// Between two samples in s, by another clock: edges lie at four places between samples, for pulses begin 337.51 samples apart.
pub const FOUR_PLACES: f64 = 1.037e-6;

impl Scope {
    /// Eight bits, half a step of noise, gains that differ by percents.
    pub const fn of(range: f64) -> Self {
        Self {
            interval: DRIVES_BEAT,
            range,
            noise: 0.5,
            gain: [1.008, 0.995, 0.997],
            delay: 0.7e-6,
            lag: 0.0,
            codes: 128.0,
            shunt: false,
        }
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/cross")
}

fn rows(file: &str) -> Vec<[f64; 5]> {
    let text = std::fs::read_to_string(folder().join(file)).expect("a reference");
    let row = |line: &str| {
        let mut numbers = line.split(',').map(|field| field.parse::<f64>().expect("a number"));
        std::array::from_fn(|k| if k == 4 { f64::NAN } else { numbers.next().expect("four") })
    };
    text.lines().skip(1).map(row).collect()
}

fn word(letter: &str) -> &'static str {
    match letter {
        "H" => "high",
        "L" => "low",
        _ => "off",
    }
}

/// A linear motor with drops, by ngspice: line pulses both ways.
pub fn ngspice() -> Pulses {
    let cases = std::fs::read_to_string(folder().join("ngspice/cases.txt")).expect("the cases");
    let sequence = cases.split("sequence pulses ").nth(1).expect("the sequence");
    let (mut legs, mut time) = (Vec::new(), 0.0);
    for line in sequence.lines().skip(1).take_while(|line| !line.trim().is_empty()) {
        let words: Vec<&str> = line.split_whitespace().collect();
        for stage in words.chunks(4) {
            legs.push((time, [word(stage[1]), word(stage[2]), word(stage[3])]));
            time += stage[0].parse::<f64>().expect("µs") * 1e-6;
        }
    }
    // L_A 9.2 mH, L_B −2.1 mH, leakage 1 µH; 2.1 mV of each junction are the model's, not the drops'.
    let truth = vec![
        ("resistance", 1.0),
        ("L_d", 1.5 * (9.2e-3 - 2.1e-3) + 1e-6),
        ("L_q", 1.5 * (9.2e-3 + 2.1e-3) + 1e-6),
        ("angle", 70.0),
        ("switch_drop", 0.9021),
        ("diode_drop", 1.0021),
        ("dead_time", 2e-6),
    ];
    Pulses {
        rows: rows("ngspice/pulses_070_drops.csv"),
        legs,
        truth,
        falls: Some(std::sync::Arc::new(|_| [0.0; 3])),
        link: 550.0,
    }
}

/// A saturated core, by SciPy: voltage vectors up to rated current.
pub fn scipy() -> Pulses {
    let vectors = ["HLL", "LHH", "LHL", "HLH", "LLH", "HHL"];
    let mut legs = vec![(0.0, ["off"; 3])];
    for (k, vector) in vectors.iter().enumerate() {
        let start = 20e-6 + 550e-6 * k as f64;
        legs.push((start, std::array::from_fn(|leg| word(&vector[leg..=leg]))));
        legs.push((start + 230e-6, ["off"; 3]));
    }
    let core = Algebraic {
        d: 89.14,
        dd: 43.0,
        d_exponent: 5,
        q: 59.0,
        qq: 40.0,
        q_exponent: 2,
        magnet_current: 40.47,
        ..Algebraic::default()
    };
    let l = move |d: f64, q: f64| {
        let flux = core.flux_at(standstill_interface::Dq::new(d, q)).expect("convex");
        core.current_and_inverse_inductance(flux).1.inverse()
    };
    let rest = l(0.0, 0.0);
    let falls = move |i: f64| {
        [1.0 - l(i, 0.0).xx / rest.xx, 1.0 - l(-i, 0.0).xx / rest.xx, 1.0 - l(0.0, i).yy / rest.yy]
    };
    let truth = vec![
        ("resistance", 1.2),
        ("L_d", rest.xx),
        ("L_q", rest.yy),
        ("angle", 40.0),
        ("switch_drop", 0.9),
        ("diode_drop", 1.0),
        ("dead_time", 2e-6),
    ];
    Pulses {
        rows: rows("scipy_pulses.csv"),
        legs,
        truth,
        falls: Some(std::sync::Arc::new(falls)),
        link: 550.0,
    }
}

/// The paper's motor with inductances and resistance that are wrong by a few per cent.
pub fn like_it() -> Motor {
    built_in("paper-5k5").expect("built in")
}

/// The same, but with a core of which is known what a fit takes cores to be known without measurement, another one with each
/// seed: the truth is a core that does not saturate, and the falls at rated current lie about it. Those along +d and −d
/// have half the width of their 95 % interval at 5 %, and so has the one along q. Only the mean of the first two is in this core.
fn like_a_linear_one(seed: u64) -> Motor {
    let mut draws = Streams::new(seed, 2).open(Purpose::GateDelay);
    let mut about_none = |half: f64| half / 1.96 * draws.normal();
    let (along_d, along_q) = (about_none(0.05 / 2.0_f64.sqrt()), about_none(0.05));
    let motor = like_it();
    let (l_d, l_q) = (motor.winding.d_axis_inductance(), motor.winding.q_axis_inductance());
    // i/I = x + γ x³ with x = ψ/(L I): at i = I the inverse inductance is 1 + 3γx² times that without current.
    let cube = |fall: f64, l: f64| {
        let rise = fall / (1.0 - fall) / 3.0;
        let most = l * motor.rated_current / (1.0 + rise);
        rise / (l * most * most)
    };
    let magnet_flux = 3.0 * l_d * motor.rated_current;
    let bridge =
        IronBridge { strength: cube(along_d, l_d), saturation: 0.0, q_share: 0.0, magnet_flux, exponent: 2 };
    let core = Algebraic {
        d: 1.0 / l_d,
        q: 1.0 / l_q,
        qq: cube(along_q, l_q),
        q_exponent: 2,
        magnet_current: magnet_flux / l_d,
        bridge: Some(bridge),
        ..Algebraic::default()
    };
    let magnetics = MagneticCircuit::new(Core::Algebraic(core)).expect("convex about no current");
    Motor { magnetics, ..motor }
}

/// All parameters of a drive are stated.
pub fn all_stated() -> Vec<String> {
    ["dead_time", "switch_drop", "switch_resistance", "diode_drop", "diode_resistance"]
        .map(str::to_owned)
        .to_vec()
}

/// What the fits begin with: a drive that is known as well as a fit takes drives to be known, another one with each seed.
pub fn start(motor: Option<Motor>, seed: u64) -> Start {
    let mut draws = Streams::new(seed, 1).open(Purpose::GateDelay);
    // Half the width of a 95 % interval is half of the value that the fit begins with, not half of the truth.
    let mut about = |value: f64| value / (1.0 + 0.5 / 1.96 * draws.normal()).max(0.2);
    let devices = Devices {
        kind: DeviceKind::Igbt,
        switch_drop: about(0.9),
        switch_resistance: about(0.05),
        diode_drop: about(1.0),
        diode_resistance: about(0.03),
    };
    let dead_time = about(2e-6);
    Start { motor, devices, dead_time, stated: all_stated(), settle: 3e-6, most_used: MOST_USED }
}

impl Pulses {
    /// As a scope writes it, with the noise of a seed; its trigger and its samples lie anywhere.
    pub fn text(&self, scope: &Scope, seed: u64) -> String {
        let mut draws = Streams::new(seed, 0).open(Purpose::CurrentNoise);
        let (phase, trigger) = (draws.uniform(), draws.normal() * 1e-4);
        let channels = if scope.shunt { 4..5 } else { 1..4 };
        let offset: Vec<f64> = channels.clone().map(|_| 0.01 * scope.range * draws.normal()).collect();
        let step = scope.range / scope.codes;
        let names = if scope.shunt { "i_link_A" } else { "i_a_A,i_b_A,i_c_A" };
        let mut text = format!("t_s,{names},u_dc_V,leg_a,leg_b,leg_c\n");
        let (first, last) = (self.rows[0][0], self.rows[self.rows.len() - 1][0]);
        let clean = self.rows[1][0] - first;
        let rows = self.behind_a_probe(scope.lag);
        let mut time = first + phase * scope.interval;
        while time < last {
            let legs = self.legs.iter().rev().find(|(from, _)| *from <= time).expect("a state").1;
            let place = ((time - scope.delay).max(first) - first) / clean;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the number of a row")]
            let before = (place as usize).min(self.rows.len() - 2);
            let share = place - before as f64;
            let _ = write!(text, "{:.9}", time + trigger);
            for (k, (zero, channel)) in offset.iter().zip(channels.clone()).enumerate() {
                let current = rows[before][channel] * (1.0 - share) + rows[before + 1][channel] * share;
                let read = scope.gain[k] * current + zero + scope.noise * step * draws.normal();
                let code = (read / step).round().clamp(-scope.codes, scope.codes - 1.0);
                let _ = write!(text, ",{:.6}", code * step);
            }
            let link = self.link * (1.0 + 5e-4 * draws.normal());
            let _ = writeln!(text, ",{link:.2},{},{},{}", legs[0], legs[1], legs[2]);
            time += scope.interval;
        }
        text
    }

    /// The rows as probes of this time constant in s show them: exact for straight lines between rows.
    fn behind_a_probe(&self, lag: f64) -> std::borrow::Cow<'_, [[f64; 5]]> {
        if lag == 0.0 {
            return (&self.rows[..]).into();
        }
        let mut shown = self.rows.clone();
        for n in 1..shown.len() {
            let (from, to) = (self.rows[n - 1], self.rows[n]);
            let time = to[0] - from[0];
            for k in 1..5 {
                let slope = (to[k] - from[k]) / time;
                let behind = shown[n - 1][k] - from[k] + slope * lag;
                shown[n][k] = to[k] - slope * lag + behind * standstill_numeric::exp(-time / lag);
            }
        }
        shown.into()
    }

    /// What the fits of these pulses begin with.
    pub fn start(&self, seed: u64) -> Start {
        let saturates = self.falls.as_ref().is_some_and(|falls| falls(1.0)[0] != 0.0);
        start(Some(if saturates { like_it() } else { like_a_linear_one(seed) }), seed)
    }

    /// What is found in one such trace.
    pub fn found(&self, scope: &Scope, seed: u64, start: &Start) -> Fit {
        let record = Record::parse("pulses.csv", &self.text(scope, seed)).expect("a record");
        fit(&[record], start, &|| false).expect("a motor")
    }

    /// The truth of an estimate as its channels tell it: their common gain makes inductances smaller.
    pub fn truth_of(&self, estimate: &Estimate, scope: &Scope) -> Option<f64> {
        let name = &estimate.name[..];
        // One channel has the common gain.
        let mean = if scope.shunt { scope.gain[0] } else { scope.gain.iter().sum::<f64>() / 3.0 };
        let falls = ["saturation.d", "saturation.minus_d", "saturation.q"];
        if let Some(fall) = falls.iter().position(|fall| *fall == name) {
            // The current that a channel reads is larger than the motor's by its gain.
            return Some((self.falls.as_ref()?)(estimate.at? / mean)[fall]);
        }
        let gains = [("gain_a", 0), ("gain_b", 1), ("gain_c", 2)];
        if let Some((_, k)) = gains.iter().find(|(gain, _)| *gain == name) {
            return Some(scope.gain[*k] / mean);
        }
        if let Some((_, truth)) =
            [("delay", scope.delay), ("probe_lag", scope.lag)].iter().find(|(of, _)| *of == name)
        {
            return Some(*truth);
        }
        let known = |name: &str| self.truth.iter().find(|(known, _)| *known == name).map(|(_, truth)| *truth);
        if name == "resistance_with_switch" {
            return Some((known("resistance")? + known("switch_resistance")?) / mean);
        }
        let truth = known(name)?;
        Some(if ["resistance", "L_d", "L_q"].contains(&name) { truth / mean } else { truth })
    }
}

/// The estimate of an angle or its half turn, whichever is nearer.
pub fn beside(value: f64, truth: f64, unit: &str, turn: f64) -> f64 {
    if unit == "deg" { value - turn * ((value - truth) / turn).round() } else { value }
}

/// A stage of an ideal drive: for how long in s, and what the legs are.
#[allow(dead_code, reason = "the example has no use for it")]
pub type Stage = (f64, [&'static str; 3]);

/// A motor of 1 Ω, 10 mH and 16 mH at 550 V whose legs have no drops and no dead time, all legs on at all times:
/// dψ/dt = u − R i with `i_d` = ψ/L (1 + γ (ψ/(8 A · L))²), by Runge and Kutta's method of fourth order.
#[allow(dead_code, clippy::disallowed_methods, reason = "the example has no use for it")]
pub fn ideal(angle: f64, gamma: f64, stages: &[Stage]) -> Pulses {
    const DT: f64 = 2e-7;
    let (l_d, l_q, resistance) = (10e-3, 16e-3, 1.0);
    let current = |psi: [f64; 2]| {
        let x = psi[0] / (8.0 * l_d);
        [psi[0] / l_d * (1.0 + gamma * x * x), psi[1] / l_q]
    };
    let axis = |k: usize| (angle - 120.0 * k as f64).to_radians();
    let (mut legs, mut rows, mut psi, mut time) = (Vec::new(), Vec::new(), [0.0; 2], 0.0);
    for (duration, stage) in stages {
        legs.push((time, *stage));
        let on = stage.map(|leg| if leg == "high" { 550.0 } else { 0.0 });
        let along = |wave: fn(f64) -> f64| 2.0 / 3.0 * (0..3).map(|k| on[k] * wave(axis(k))).sum::<f64>();
        let voltage = [along(f64::cos), -along(f64::sin)];
        let slope = |psi: [f64; 2]| {
            let i = current(psi);
            [voltage[0] - resistance * i[0], voltage[1] - resistance * i[1]]
        };
        let ahead = |psi: [f64; 2], k: [f64; 2], h: f64| [psi[0] + h * k[0], psi[1] + h * k[1]];
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of steps")]
        for _ in 0..(duration / DT).round() as usize {
            let i = current(psi);
            let phase = |k: usize| i[0] * axis(k).cos() - i[1] * axis(k).sin();
            rows.push([time, phase(0), phase(1), phase(2), f64::NAN]);
            let a = slope(psi);
            let b = slope(ahead(psi, a, DT / 2.0));
            let c = slope(ahead(psi, b, DT / 2.0));
            let d = slope(ahead(psi, c, DT));
            psi = std::array::from_fn(|n| psi[n] + DT / 6.0 * (a[n] + 2.0 * b[n] + 2.0 * c[n] + d[n]));
            time += DT;
        }
    }
    let truth = vec![
        ("resistance", resistance),
        ("L_d", l_d),
        ("L_q", l_q),
        ("angle", angle),
        ("switch_drop", 0.0),
        ("diode_drop", 0.0),
        ("dead_time", 0.0),
    ];
    Pulses { rows, legs, truth, falls: None, link: 550.0 }
}
