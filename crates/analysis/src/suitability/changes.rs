//! Changes of drive, sensors and motor that an engineer can make.

use std::fmt::Write as _;

use standstill_detect::{MethodName, keys};
use standstill_scenario::Rotor;
use standstill_sim::{Arrangement, Comparators};

use super::bench::{Bench, READ, Setting};
use super::margins::Demand;

/// A change of the scenario's keys or of the allowed current, which may make a motor suited.
pub(super) struct Change {
    pub words: String,
    pub keys: Vec<(&'static str, String)>,
    pub current: Option<f64>,
    /// The demand that the change removes.
    pub lifts: Option<Demand>,
}

/// Keys of errors of sensors and drive. One change improves all of them together.
const FINER: [&str; 9] = [
    "sensors.bits",
    "sensors.range_low",
    "sensors.jitter",
    "sensors.noise",
    "sensors.gain_error",
    "sensors.timer",
    "sensors.terminal_bits",
    "sensors.terminal_noise",
    "inverter.dead_time",
];

impl Change {
    /// Returns true if the change reduces an error of the sensors or of the drive.
    pub fn is_finer(&self) -> bool {
        self.keys.iter().any(|(key, _)| FINER.contains(key))
    }
}

/// Lists the changes to be tried. `stalled`: largest phase current in A, if the DC link drives no larger one; a higher link is tried then
/// instead of more current. If several of them improve sensors and dead time, the last entry combines all of these.
pub(super) fn changes(bench: &Bench<'_>, methods: &[MethodName], stalled: Option<f64>) -> Vec<Change> {
    let mut changes = Vec::new();
    if bench.rotors.contains(&Rotor::Free) {
        let brake = keyed("a brake that holds the rotor", "rotor.state", "locked".to_owned());
        changes.push(Change { lifts: Some(Demand::Movement), ..brake });
    }
    let of = |method: &MethodName| bench.scenario(&Setting::plain(*method), Rotor::Locked).ok();
    let Some(scenario) = methods.iter().find_map(of) else { return changes };
    let (sensors, drive) = (scenario.sensors, scenario.drive);
    let reads_currents = sensors.arrangement != Arrangement::None;
    let adc = sensors.adc.filter(|_| reads_currents);
    let range = adc.map_or(f64::INFINITY, |adc| adc.high);
    changes.extend(currents(bench, stalled, drive.link.voltage, range));
    let comparator = sensors.comparator;
    if comparator.timer > 0.0 && comparator.arrangement == Comparators::PerLeg && comparator.offset > 0.0 {
        let words = "one comparator for all legs, whose offset speaks for no pole";
        changes.push(keyed(words, "sensors.comparators", Comparators::Common.name().to_owned()));
    }
    if scenario.detector.get(&keys::SECTOR).is_some_and(|width| width.number() == 0.0) {
        let words = "sectors of 60° in place of angles, as a six-step start needs them";
        changes.push(keyed(words, "detector.sector", "60 deg".to_owned()));
    }
    let mut finer = Vec::new();
    if let Some(adc) = adc.filter(|adc| adc.bits < 16) {
        finer.push(keyed("a converter of 16 bits", "sensors.bits", "16".to_owned()));
        let smaller = digits(1.1 * bench.most_current, 3);
        if smaller < range {
            let words = format!("a sensor range of {smaller} A with its {} bits", adc.bits);
            changes.push(keyed(&words, "sensors.range", format!("{smaller} A")));
        }
    }
    // Amplifiers that read one direction clip the readings of a decaying current.
    if let Some(adc) = adc.filter(|adc| adc.low > -0.3 * bench.most_current) {
        let low = format!("-{} A", digits(adc.high.min(1.1 * bench.most_current), 3));
        finer.push(keyed(
            &format!("a bias of the amplifiers, so that they read from {low} on"),
            "sensors.range_low",
            low,
        ));
    }
    if reads_currents && sensors.jitter.seconds() > 0.0 {
        let jitter = format!("{} ns", digits(sensors.jitter.seconds() * 1e9 / 4.0, 2));
        finer.push(keyed(&format!("a quarter of the triggers' jitter, {jitter}"), "sensors.jitter", jitter));
    }
    if reads_currents && sensors.noise > 0.0 {
        let noise = format!("{} A", digits(sensors.noise / 4.0, 2));
        finer.push(keyed(&format!("a quarter of the sensors' noise, {noise}"), "sensors.noise", noise));
    }
    if reads_currents && sensors.gain_error > 0.0 {
        let gain = format!("{} %", digits(100.0 * sensors.gain_error / 4.0, 2));
        finer.push(keyed(&format!("sensors calibrated to {gain}"), "sensors.gain_error", gain));
    }
    if comparator.timer > 0.0 {
        let tick = format!("{} us", digits(comparator.timer * 1e6 / 4.0, 2));
        finer.push(keyed(&format!("a timer of four times the clock, {tick} a tick"), "sensors.timer", tick));
    }
    if let Some(divider) = sensors.terminal {
        if divider.adc.is_some_and(|adc| adc.bits < 16) {
            let words = "a converter of 16 bits for the terminals";
            finer.push(keyed(words, "sensors.terminal_bits", "16".to_owned()));
        }
        if divider.noise > 0.0 {
            let noise = format!("{} V", digits(divider.noise / 4.0, 2));
            let words = format!("a quarter of the noise at the terminals, {noise}");
            finer.push(keyed(&words, "sensors.terminal_noise", noise));
        }
    }
    let dead = drive.dead_time.seconds() * 1e6;
    if dead > 0.0 {
        let dead = format!("{} us", digits(dead / 4.0, 2));
        finer.push(keyed(&format!("a quarter of the dead time, {dead}"), "inverter.dead_time", dead));
    }
    let all = (finer.len() > 1).then(|| Change {
        words: "all changes of sensors and dead time together".to_owned(),
        keys: finer.iter().flat_map(|change| change.keys.clone()).collect(),
        current: None,
        lifts: None,
    });
    changes.extend(finer);
    changes.extend(all);
    changes
}

/// Lists the changes by which more current flows. `link`: voltage of the DC link in V. `range`: largest current in A that the sensors read.
fn currents(bench: &Bench<'_>, stalled: Option<f64>, link: f64, range: f64) -> Vec<Change> {
    let mut changes = Vec::new();
    // If the link's voltage is far below that of the data sheet, the data sheet's voltage is tried first.
    if let Some(voltage) = bench.motor.dc_link.filter(|voltage| stalled.is_some() && *voltage > 1.01 * link) {
        let words = format!("the data sheet's DC link of {voltage} V");
        changes.push(keyed(&words, "inverter.dc_link", format!("{voltage} V")));
    }
    for factor in
        stalled.into_iter().flat_map(|reached| [1.2, 3.0].map(|more| more * bench.most_current / reached))
    {
        // The current of a pulse that a resistance limits, or of the longest one, is proportional to the voltage.
        let voltage = digits(factor * link, 3);
        changes.push(keyed(&format!("a DC link of {voltage} V"), "inverter.dc_link", format!("{voltage} V")));
    }
    // If the user allows less than rated current, rated current is tried first.
    let rated = digits(bench.motor.rated_current, 3);
    if bench.most_current < 0.98 * rated && rated < READ * range {
        changes.push(more_current(format!("rated current, {rated} A"), rated));
    }
    for factor in [1.5, 2.0, 3.0].into_iter().filter(|_| stalled.is_none()) {
        let current = digits(bench.most_current * factor, 3);
        let mut change = more_current(format!("{factor} times the current, {current} A"), current);
        if factor > 2.0 {
            change.words += " (if the magnets bear it)";
        }
        // The sensors must read it.
        if current >= READ * range {
            let range = digits(1.1 * current, 3);
            let _ = write!(change.words, " with sensors that read up to {range} A");
            change.keys.push(("sensors.range", format!("{range} A")));
        }
        changes.push(change);
    }
    changes
}

/// Rounds to this number of significant digits.
pub(super) fn digits(value: f64, count: i32) -> f64 {
    let power = standstill_quantity::magnitude(value).unwrap_or(0) - count + 1;
    standstill_quantity::rounded(standstill_quantity::rounded(value, -power).round(), power)
}

pub(super) fn keyed(words: &str, key: &'static str, value: String) -> Change {
    Change { words: words.to_owned(), keys: vec![(key, value)], current: None, lifts: None }
}

const fn more_current(words: String, current: f64) -> Change {
    Change { words, keys: Vec::new(), current: Some(current), lifts: None }
}
