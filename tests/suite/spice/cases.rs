//! What the lines of `tests/cross/ngspice/cases.txt` mean.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use standstill_interface::{Abc, Command, Leg, Nanos, Sampling, Stage};
use standstill_inverter::{DeviceKind, Devices, GateTiming};
use standstill_plant::{Motor, Winding};

use standstill_sim::{Broken, Short};

use crate::bench::paper_motor;

/// What a junction of the netlists drops, in V.
const JUNCTION: f64 = 2.1e-3;

/// One line `case` of `cases.txt` with all it names.
#[derive(Clone)]
pub struct Spice {
    pub name: String,
    pub angle_deg: f64,
    pub motor: Motor,
    pub devices: Devices,
    pub timing: GateTiming,
    /// Of each terminal, in F.
    pub capacitance: f64,
    /// What one phase against the two others resists to what rings, in Ω.
    pub resistance: f64,
    /// Of the divider at each terminal, in Ω.
    pub load: Option<f64>,
    /// Turns that are shorted.
    pub short: Option<Broken>,
    pub commands: Vec<Command<f64>>,
}

pub fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cross/ngspice")
}

pub fn number(word: &str) -> f64 {
    word.parse().unwrap_or_else(|_| panic!("not a number: {word}"))
}

fn micros(word: &str) -> Nanos {
    Nanos::from_seconds(number(word) * 1e-6)
}

fn leg(word: &str) -> Leg<f64> {
    match word {
        "-" => Leg::Off,
        "L" => Leg::Low,
        "H" => Leg::High,
        duty => Leg::Duty(number(duty)),
    }
}

fn motor(values: &[&str]) -> Motor {
    let &[mean, saliency, leakage, resistance] = values else {
        panic!("a motor has four values: {values:?}")
    };
    let mut motor = paper_motor();
    motor.winding = Winding {
        mean_inductance: number(mean) * 1e-3,
        saliency: number(saliency) * 1e-3,
        leakage: number(leakage) * 1e-3,
    };
    motor.resistance = number(resistance);
    motor.linearised()
}

fn devices(values: &[&str]) -> Devices {
    let (values, kind) = match values {
        [values @ .., "mosfet"] => (values, DeviceKind::Mosfet),
        values => (values, DeviceKind::Igbt),
    };
    let &[switch, switch_slope, diode, diode_slope] = values else { panic!("devices: {values:?}") };
    // A channel has no junction.
    let junction = if kind == DeviceKind::Mosfet { 0.0 } else { JUNCTION };
    Devices {
        kind,
        switch_drop: number(switch) + junction,
        switch_resistance: number(switch_slope) * 1e-3,
        diode_drop: number(diode) + JUNCTION,
        diode_resistance: number(diode_slope) * 1e-3,
    }
}

fn short(values: &[&str]) -> Broken {
    let &[phase, share, resistance, coupling] = values else { panic!("short: {values:?}") };
    let phase = "abc".find(phase).unwrap_or_else(|| panic!("not a phase: {phase}"));
    let short = Short { share: number(share), resistance: number(resistance), coupling: number(coupling) };
    Broken::Shorted(phase, short)
}

fn timing(values: &[&str]) -> GateTiming {
    let &[dead, off, on] = values else { panic!("timing: {values:?}") };
    GateTiming { dead_time: micros(dead), turn_off_delay: micros(off), turn_on_delay: micros(on) }
}

/// A line of a sequence: one or two stages, sampled from `first` on every `interval`.
fn command(words: &[&str], first: Nanos, interval: Nanos) -> Command<f64> {
    let mut stages = words.chunks_exact(4).map(|words| Stage {
        legs: Abc::new(leg(words[1]), leg(words[2]), leg(words[3])),
        duration: micros(words[0]),
    });
    let mut command = Command::hold(stages.next().expect("a stage"), Sampling::NONE);
    command.then = stages.next();
    assert!(stages.next().is_none() && words.len().is_multiple_of(4), "one or two stages: {words:?}");
    let duration = command.duration().0;
    assert!(duration.is_multiple_of(interval.0) && first < interval, "samples equally spaced: {words:?}");
    let count = u32::try_from(duration / interval.0).expect("few");
    command.sampling = Sampling { first, interval, count };
    command
}

/// All cases of `cases.txt`.
pub fn cases() -> Vec<Spice> {
    let text = std::fs::read_to_string(folder().join("cases.txt")).expect("cases.txt");
    let (mut motors, mut drops, mut timings) = (BTreeMap::new(), BTreeMap::new(), BTreeMap::new());
    let mut shorts = BTreeMap::new();
    let mut sequences: BTreeMap<&str, Vec<Command<f64>>> = BTreeMap::new();
    let mut sampled = ("", Nanos::ZERO, Nanos::ZERO);
    let mut cases = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default();
        match line.split_whitespace().collect::<Vec<_>>().as_slice() {
            [] => {}
            ["motor", name, values @ ..] => drop(motors.insert(*name, motor(values))),
            ["devices", name, values @ ..] => drop(drops.insert(*name, devices(values))),
            ["short", name, values @ ..] => drop(shorts.insert(*name, short(values))),
            ["timing", name, values @ ..] => drop(timings.insert(*name, timing(values))),
            ["sequence", name, first, interval] => sampled = (*name, micros(first), micros(interval)),
            ["case", name, sequence, angle, motor, devices, timing, terminals @ ..] => cases.push(Spice {
                name: (*name).to_owned(),
                angle_deg: number(angle),
                motor: motors[motor].clone(),
                devices: drops[devices],
                timing: timings[timing],
                capacitance: terminals.first().map_or(0.0, |word| number(word) * 1e-9),
                resistance: terminals.get(1).map_or(0.0, |word| number(word)),
                load: terminals.get(2).map(|word| number(word) * 1e3).filter(|load| *load > 0.0),
                short: terminals.get(3).map(|word| shorts[word]),
                commands: sequences[sequence].clone(),
            }),
            stages => {
                let (name, first, interval) = sampled;
                sequences.entry(name).or_default().push(command(stages, first, interval));
            }
        }
    }
    cases
}
