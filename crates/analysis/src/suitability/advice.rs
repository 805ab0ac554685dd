//! What would make a motor suited, where no setting does: tried on the bench, one change at a time.

use standstill_detect::MethodName;
use standstill_scenario::{Document, Origin, Rotor};

use super::bench::{Bench, Setting};
use super::{Demands, Progress, SuitabilityError};

/// A change that was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// In words.
    pub change: String,
    /// What `standstill check` is told for it.
    pub option: String,
    /// Settings with which the motor is then suited; none where the change does not help.
    pub helps: Option<Setting>,
}

/// A change of the drive or of what is demanded.
struct Change {
    words: String,
    option: String,
    keys: Vec<(&'static str, String)>,
    current: Option<f64>,
}

/// Methods that changes are tried with: those whose detection is short.
const METHODS: [MethodName; 3] =
    [MethodName::Bipolar, MethodName::MaximumLikelihood, MethodName::LineInductanceFast];

/// Tries the changes that a drive's engineer can make.
pub(super) fn tried(
    bench: &Bench<'_>,
    methods: &[MethodName],
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Advice>, SuitabilityError> {
    let mut advice = Vec::new();
    for change in changes(bench)? {
        hear(Progress::Change(&change.words));
        let mut document = bench.document.clone();
        for (key, value) in &change.keys {
            document.set(key, value, Origin::CommandLine)?;
        }
        let demands = Demands { current_a: change.current.or(bench.demands.current_a), ..*bench.demands };
        let helps = helps(&document, bench, &demands, methods)?;
        advice.push(Advice { change: change.words, option: change.option, helps });
    }
    Ok(advice)
}

/// The first settings that hold with a change.
fn helps(
    document: &Document,
    bench: &Bench<'_>,
    demands: &Demands,
    methods: &[MethodName],
) -> Result<Option<Setting>, SuitabilityError> {
    let mut changed = Bench::new(document, bench.motor, demands);
    changed.has_pole = bench.has_pole;
    for method in METHODS.into_iter().filter(|method| methods.contains(method)) {
        let found = match changed.search(method) {
            Err(SuitabilityError::File(_)) => continue,
            found => found?,
        };
        for look in found.looks.iter().filter(|look| look.margins.is_kept()).take(2) {
            if changed.confirm(&look.setting)?.is_ok() {
                return Ok(Some(look.setting.clone()));
            }
        }
    }
    Ok(None)
}

fn changes(bench: &Bench<'_>) -> Result<Vec<Change>, SuitabilityError> {
    let sensors = bench.scenario(&Setting::plain(METHODS[0]), Rotor::Locked, false).map(|of| of.sensors);
    let (bits, range) = match sensors.ok().and_then(|sensors| sensors.adc) {
        Some(adc) => (Some(adc.bits), adc.high),
        None => (None, f64::INFINITY),
    };
    let mut changes = Vec::new();
    if bench.rotors.contains(&Rotor::Free) {
        changes.push(keyed("a brake that holds the rotor", "rotor.state", "locked".to_owned()));
    }
    for factor in [1.5, 2.0] {
        let current = bench.most_current * factor;
        // More than the sensors read is no help.
        if current < 0.98 * range {
            let current = standstill_quantity::rounded(standstill_quantity::rounded(current, 2).round(), -2);
            changes.push(Change {
                words: format!("{factor} times the current, {current} A"),
                option: format!("--current {current}"),
                keys: Vec::new(),
                current: Some(current),
            });
        }
    }
    if let Some(bits) = bits.filter(|bits| *bits < 16) {
        changes.push(keyed("a converter of 16 bits", "sensors.bits", "16".to_owned()));
        let smaller = standstill_quantity::rounded(standstill_quantity::rounded(1.1 * bench.most_current, 2).ceil(), -2);
        if smaller < range {
            let words = format!("a sensor range of {smaller} A with its {bits} bits");
            changes.push(keyed(&words, "sensors.range", format!("{smaller} A")));
        }
    }
    if let Ok(sensors) = bench.scenario(&Setting::plain(METHODS[0]), Rotor::Locked, false).map(|of| of.sensors)
        && sensors.noise > 0.0
    {
        let noise = standstill_quantity::rounded(sensors.noise / 4.0, 3);
        let power = standstill_quantity::magnitude(noise).unwrap_or(0) - 1;
        let digits = standstill_quantity::rounded(noise, -power).round();
        let noise = format!("{} mA", standstill_quantity::rounded(digits, power));
        changes.push(keyed(&format!("a quarter of the sensors' noise, {noise}"), "sensors.noise", noise));
    }
    Ok(changes)
}

fn keyed(words: &str, key: &'static str, value: String) -> Change {
    let shown = if value.contains(' ') { format!("-s \"{key}={value}\"") } else { format!("-s {key}={value}") };
    Change { words: words.to_owned(), option: shown, keys: vec![(key, value)], current: None }
}
