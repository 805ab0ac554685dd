//! Changes that would make a motor suited if no settings do: each is tried by trials, one change at a time.

use standstill_detect::{MethodName, keys};
use standstill_scenario::{Document, Origin, Rotor};
use standstill_sim::{Arrangement, Comparators};

use super::bench::{Bench, Setting};
use super::condition::QUICK;
use super::{Demands, Progress, SuitabilityError};

/// A change that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Description of the change in words.
    pub change: String,
    /// Option of `standstill check` that makes the change.
    pub option: String,
    /// Settings with which the motor is suited after the change; none if the change does not help.
    pub helps: Option<Setting>,
}

/// A change of the drive or of the demands.
struct Change {
    words: String,
    option: String,
    keys: Vec<(&'static str, String)>,
    current: Option<f64>,
}

/// Keys of errors of sensors and drive that are improved together.
const FINER: [&str; 7] = [
    "sensors.bits",
    "sensors.noise",
    "sensors.gain_error",
    "sensors.timer",
    "sensors.terminal_bits",
    "sensors.terminal_noise",
    "inverter.dead_time",
];

/// Tries the changes that a drive's engineer can make.
pub(super) fn tried(
    bench: &Bench<'_>,
    methods: &[MethodName],
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Advice>, SuitabilityError> {
    let mut advice = Vec::new();
    let short: Vec<MethodName> = QUICK.into_iter().filter(|method| methods.contains(method)).collect();
    let methods = if short.is_empty() { methods } else { &short[..] };
    let mut changes = changes(bench, methods);
    if changes.is_empty() {
        return Ok(advice);
    }
    // What does not help together does not help alone, so the last is the first.
    changes.rotate_right(1);
    let mut together = true;
    for change in changes {
        if !together && change.keys.iter().any(|(key, _)| FINER.contains(key)) {
            advice.push(Advice { change: change.words, option: change.option, helps: None });
            continue;
        }
        hear(Progress::Change(&change.words));
        let mut document = bench.document.clone();
        for (key, value) in &change.keys {
            document.set(key, value, Origin::CommandLine)?;
        }
        let demands = Demands { current_a: change.current.or(bench.demands.current_a), ..*bench.demands };
        let helps = helps(&document, bench, &demands, methods)?;
        together = helps.is_some() || change.keys.len() < 2 && together;
        advice.push(Advice { change: change.words, option: change.option, helps });
    }
    // The simplest first.
    advice.rotate_left(1);
    Ok(advice)
}

/// Returns the first settings that meet the demands after a change.
fn helps(
    document: &Document,
    bench: &Bench<'_>,
    demands: &Demands,
    methods: &[MethodName],
) -> Result<Option<Setting>, SuitabilityError> {
    let mut changed = Bench::new(document, bench.motor, demands);
    changed.has_pole = bench.has_pole;
    for method in methods {
        let found = match changed.search(*method) {
            Err(SuitabilityError::File(_)) => continue,
            found => found?,
        };
        for (failed, look) in (0..2).zip(found.looks.iter().filter(|look| look.margins.is_kept())) {
            if changed.confirm(&look.setting, failed)?.is_ok() {
                return Ok(Some(look.setting.clone()));
            }
        }
    }
    Ok(None)
}

fn changes(bench: &Bench<'_>, methods: &[MethodName]) -> Vec<Change> {
    let mut changes = Vec::new();
    if bench.rotors.contains(&Rotor::Free) {
        changes.push(keyed("a brake that holds the rotor", "rotor.state", "locked".to_owned()));
    }
    let of = |method: &MethodName| bench.scenario(&Setting::plain(*method), Rotor::Locked).ok();
    let Some(scenario) = methods.iter().find_map(of) else { return changes };
    let (sensors, drive) = (scenario.sensors, scenario.drive);
    let reads_currents = sensors.arrangement != Arrangement::None;
    let adc = sensors.adc.filter(|_| reads_currents);
    let range = adc.map_or(f64::INFINITY, |adc| adc.high);
    for factor in [1.5, 2.0] {
        let current = digits(bench.most_current * factor, 3);
        // More than the sensors read is no help.
        if current < 0.98 * range {
            let (words, option) =
                (format!("{factor} times the current, {current} A"), format!("--current {current}"));
            changes.push(Change { words, option, keys: Vec::new(), current: Some(current) });
        }
    }
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
        option: finer.iter().map(|change| change.option.as_str()).collect::<Vec<_>>().join(" "),
        keys: finer.iter().flat_map(|change| change.keys.clone()).collect(),
        current: None,
    });
    changes.extend(finer);
    changes.extend(all);
    changes
}

/// Rounds to this number of significant digits.
fn digits(value: f64, count: i32) -> f64 {
    let power = standstill_quantity::magnitude(value).unwrap_or(0) - count + 1;
    standstill_quantity::rounded(standstill_quantity::rounded(value, -power).round(), power)
}

fn keyed(words: &str, key: &'static str, value: String) -> Change {
    let shown =
        if value.contains(' ') { format!("-s \"{key}={value}\"") } else { format!("-s {key}={value}") };
    Change { words: words.to_owned(), option: shown, keys: vec![(key, value)], current: None }
}
