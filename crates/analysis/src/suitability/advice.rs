//! Advice for a motor that no settings suit: a change of drive or rotor that would suit it, found by trials of one
//! change at a time; if no change suffices, other ways to start the motor.

use standstill_campaign::Summary;
use standstill_detect::MethodName;
use standstill_interface::choice;
use standstill_plant::Motor;
use standstill_scenario::{Document, Origin, Rotor};

use super::bench::{Bench, Look, SEARCH, Setting};
use super::changes::{self, Change, digits, keyed};
use super::condition::QUICK;
use super::margins::Demand;
use super::search::{Found, SEARCHED};
use super::{Demands, Progress, Suitability, SuitabilityError, relaxed};

/// A change that was tried for a motor that no settings suit.
#[derive(Clone, Debug, PartialEq)]
pub struct Advice {
    /// Description of the change in words.
    pub change: String,
    /// Keys of the scenario that the change sets, with their values.
    pub keys: Vec<(&'static str, String)>,
    /// Keys of the detector that the change removes from the scenario, so that the search chooses their values.
    pub frees: Vec<&'static str>,
    /// All demands after the change. None if the change does not alter the demands.
    pub demands: Option<Demands>,
    /// Settings that suit the motor after the change. None if the change does not help.
    pub helps: Option<Setting>,
}

choice! {
    /// Another way to start a motor whose position no settings find.
    pub enum Way {
        /// These settings find the axis; the pole takes a Hall sensor or an encoder.
        Axis = "axis-alone",
        /// A current along one direction turns the rotor there.
        Alignment = "alignment",
    }
}

/// Another way to start the motor, with the results of its trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Alternative {
    /// The way.
    pub way: Way,
    /// Settings of the detector.
    pub setting: Setting,
    /// Results of the simulated motor starts. The rotor is in the last judged state, which is free if it may move.
    pub starts: Summary,
}

/// Number of starts by which settings are judged that find only the axis.
const STARTS: u64 = 200;
/// Number of starts that replaces [`STARTS`] for alignment by a direct current. It is small because an alignment takes seconds of simulated
/// time.
const SLOW_STARTS: u64 = 24;

/// Tries changes that the drive's engineer can make. `methods` has the methods with the settings found for each. Descriptions of changes
/// for which no work is left are added to `untried`.
pub(super) fn tried(
    bench: &Bench<'_>,
    methods: &[(MethodName, &Found)],
    found: &Suitability,
    untried: &mut Vec<String>,
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Advice>, SuitabilityError> {
    if !found.has_saliency() {
        let (advice, cut) = bench.work.within(1.0, || salient(bench, &short(methods), hear));
        let advice = advice?;
        if advice.is_none() && cut {
            untried.push("larger values of L_q".to_owned());
        }
        return Ok(advice.into_iter().collect());
    }
    // No change of the drive makes the poles draw different currents.
    if found.poles_are_alike() {
        return Ok(Vec::new());
    }
    // Settings that the user gave come before changes of the drive.
    if let Some(advice) = freed(bench, methods, untried, hear)? {
        return Ok(vec![advice]);
    }
    let mut advice = changed(bench, methods, stalled(found), untried, hear)?;
    let (relaxed, cut) = bench.work.within(1.0, || relaxed::tried(bench, methods, hear));
    let relaxed = relaxed?;
    if relaxed.is_none() && cut {
        untried.push("demands that would hold".to_owned());
    }
    advice.extend(relaxed);
    Ok(advice)
}

/// Returns the methods with short detections, or all methods if none of them has short detections.
fn short(methods: &[(MethodName, &Found)]) -> Vec<MethodName> {
    let has = |method: &MethodName| methods.iter().any(|(other, _)| other == method);
    let short: Vec<MethodName> = QUICK.into_iter().filter(has).collect();
    if short.is_empty() { methods.iter().map(|(method, _)| *method).collect() } else { short }
}

/// Searches values for those keys of the detector that the user set. Returns the settings that meet the demands. None if the user set no
/// such key, or if no tried values meet the demands.
fn freed(
    bench: &Bench<'_>,
    methods: &[(MethodName, &Found)],
    untried: &mut Vec<String>,
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<Advice>, SuitabilityError> {
    let frees: Vec<&'static str> = SEARCHED.into_iter().filter(|key| bench.is_set(key)).collect();
    if frees.is_empty() {
        return Ok(None);
    }
    let names: Vec<String> = frees.iter().map(|key| format!("`detector.{key}`")).collect();
    let change = format!("{} left to the search", names.join(" and "));
    hear(Progress::Change(&change));
    let mut document = bench.document.clone();
    for key in &frees {
        document.remove(&format!("detector.{key}"));
    }
    let mut free = Bench::new(&document, bench.motor, bench.demands, bench.work);
    free.has_pole = bench.has_pole;
    let (found, cut) = bench.work.within(0.5, || searched(&free, &short(methods)));
    let (helps, is_open) = found?;
    if helps.is_none() && (cut || is_open) {
        untried.push(change.clone());
    }
    let advice = |helps| Advice { change, keys: Vec::new(), frees, demands: None, helps: Some(helps) };
    Ok(helps.map(advice))
}

/// Returns the largest phase current in A of the judged settings, with the rotor locked where that was judged, if it stays well below the allowed one because the DC link, or the longest
/// pulse, drives no larger current. None if larger currents flow.
fn stalled(found: &Suitability) -> Option<f64> {
    let judged = || found.candidates.iter().filter(|candidate| candidate.is_judged());
    // A rotor that the pulses turn adds its own voltage.
    let peaks = judged().map(|of| if of.locked.trials > 0 { &of.locked } else { &of.free });
    let peak = peaks.map(|starts| starts.peak_current_a).fold(0.0, f64::max);
    let is_stalled = judged().any(|candidate| candidate.binding.is_none());
    (is_stalled && peak > 0.0 && peak < 0.8 * found.most_current_a).then_some(peak)
}

/// Tries changes of drive, sensors, rotor and allowed current. Each change may use an equal share of the remaining work.
fn changed(
    bench: &Bench<'_>,
    methods: &[(MethodName, &Found)],
    stalled: Option<f64>,
    untried: &mut Vec<String>,
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Advice>, SuitabilityError> {
    let short = short(methods);
    let mut changes = changes::changes(bench, &short, stalled);
    if changes.is_empty() {
        return Ok(Vec::new());
    }
    let mut advice = Vec::new();
    // The last change combines several. It is tried first: if it does not help, none of its parts helps either.
    changes.rotate_right(1);
    let (mut together, count) = (true, changes.len());
    for (number, mut change) in changes.into_iter().enumerate() {
        let (helps, is_open) = if !together && change.is_finer() {
            (None, false)
        } else {
            hear(Progress::Change(&change.words));
            // One share of the work stays for relaxed demands. A change that lifts the only missed demand is the likeliest to help.
            let lifts = change.lifts.is_some_and(|lifted| kept_but(methods, lifted).next().is_some());
            let share = if lifts { 0.5 } else { 1.0 / (count - number + 1) as f64 };
            let (helps, cut) = bench.work.within(share, || of_change(bench, &change, methods, &short));
            let (helps, is_open) = helps?;
            if is_open && helps.is_none() {
                change.words = format!("more starts with {}", change.words);
            }
            let is_open = is_open || cut;
            together = helps.is_some() || is_open || change.keys.len() < 2 && together;
            (helps, is_open)
        };
        let demands = change.current.map(|current| Demands { current_a: Some(current), ..*bench.demands });
        let is_open = helps.is_none() && is_open;
        advice.push((
            is_open,
            Advice { change: change.words, keys: change.keys, frees: Vec::new(), demands, helps },
        ));
    }
    // Back to the order of the list: the simplest change first.
    advice.rotate_left(1);
    let (open, tried): (Vec<_>, Vec<_>) = advice.into_iter().partition(|(is_open, _)| *is_open);
    untried.extend(open.into_iter().map(|(_, advice)| advice.change));
    Ok(tried.into_iter().map(|(_, advice)| advice).collect())
}

/// Settings that meet the demands (`None` without such settings), and a flag. The flag is true if some settings met the demands on too few
/// starts to show it.
type Helps = (Option<Setting>, bool);

/// Searches settings that meet the demands after a change.
fn of_change(
    bench: &Bench<'_>,
    change: &Change,
    methods: &[(MethodName, &Found)],
    short: &[MethodName],
) -> Result<Helps, SuitabilityError> {
    let mut document = bench.document.clone();
    for (key, value) in &change.keys {
        document.set(key, value, Origin::CommandLine)?;
    }
    let demands = Demands { current_a: change.current.or(bench.demands.current_a), ..*bench.demands };
    let mut changed = Bench::new(&document, bench.motor, &demands, bench.work);
    changed.has_pole = bench.has_pole;
    let (helps, mut is_open) = searched(&changed, short)?;
    let (None, Some(lifted)) = (&helps, change.lifts) else { return Ok((helps, is_open)) };
    // Methods that are not searched anew, and whose settings miss only the demand that the change lifts.
    for look in kept_but(methods, lifted).filter(|look| !short.contains(&look.setting.method)) {
        match changed.settled(std::iter::once((0, look)), &mut 0, &mut |_| {})? {
            (_, Ok(_)) => return Ok((Some(look.setting.clone()), false)),
            (_, Err(refused)) => is_open |= refused.is_open,
        }
    }
    Ok((None, is_open))
}

/// Iterates over the best settings of each method that meet all demands except possibly `lifted`. Methods without such settings are left
/// out.
fn kept_but<'a>(methods: &'a [(MethodName, &Found)], lifted: Demand) -> impl Iterator<Item = &'a Look> {
    methods
        .iter()
        .filter_map(move |(_, found)| found.looks.iter().find(|look| look.margins.is_kept_but(lifted)))
}

/// Searches the methods one after the other. Returns the first settings that fresh starts confirm.
fn searched(bench: &Bench<'_>, methods: &[MethodName]) -> Result<Helps, SuitabilityError> {
    let mut is_open = false;
    for method in methods {
        let found = match bench.search(*method) {
            Err(SuitabilityError::File(_)) => continue,
            found => found?,
        };
        let kept = found.looks.iter().enumerate().filter(|(_, look)| look.margins.is_kept());
        match bench.settled(kept, &mut 0, &mut |_| {})? {
            (place, Ok(_)) => return Ok((Some(found.looks[place].setting.clone()), false)),
            (_, Err(refused)) => is_open |= refused.is_open,
        }
    }
    Ok((None, is_open))
}

/// Ratios of L_q to L_d that are tried if a data sheet gives both axes the same inductance.
const RATIOS: [f64; 5] = [1.06, 1.12, 1.25, 1.5, 2.0];

/// Finds the smallest tried L_q with which a motor is suited. It is used if the data sheet gives one inductance for both axes. None if the
/// data sheet has no key for L_q, or if no tried value suffices.
fn salient(
    bench: &Bench<'_>,
    methods: &[MethodName],
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<Advice>, SuitabilityError> {
    let l_d = bench.motor.winding.d_axis_inductance();
    for ratio in RATIOS {
        let value = format!("{} uH", digits(1e6 * l_d * ratio, 4));
        let words = format!(
            "an L_q of {value}, {:.0} % above L_d, if that is what is measured",
            100.0 * (ratio - 1.0)
        );
        let change = keyed(&words, "motor.nameplate.L_q", value);
        let Some((document, motor)) = with_motor(bench.document, &change) else { return Ok(None) };
        hear(Progress::Change(&change.words));
        let changed = Bench::new(&document, &motor, bench.demands, bench.work);
        if let (Some(setting), _) = searched(&changed, methods)? {
            let Change { words, keys, .. } = change;
            return Ok(Some(Advice {
                change: words,
                keys,
                frees: Vec::new(),
                demands: None,
                helps: Some(setting),
            }));
        }
    }
    Ok(None)
}

/// Returns the document and the motor after a change of the motor. None if the data sheet does not have the changed key.
fn with_motor(document: &Document, change: &Change) -> Option<(Document, Motor)> {
    let mut document = document.clone();
    for (key, value) in &change.keys {
        document.set(key, value, Origin::CommandLine).ok()?;
    }
    let motor = document.motor().ok()?;
    Some((document, motor))
}

/// Tries other ways to start a motor whose position no settings find.
pub(super) fn alternatives(
    bench: &Bench<'_>,
    methods: &[(MethodName, &Found)],
) -> Result<Vec<Alternative>, SuitabilityError> {
    let mut all = Vec::new();
    if bench.has_pole {
        let mut axis = Bench::new(bench.document, bench.motor, bench.demands, bench.work);
        axis.has_pole = false;
        if let (Some(setting), _) = searched(&axis, &short(methods))? {
            all.extend(axis.alternative(Way::Axis, setting)?);
        }
    }
    // A held rotor cannot be aligned.
    if bench.rotors.contains(&Rotor::Free) {
        let demands = Demands { movement_deg: 360.0, time_s: f64::INFINITY, ..*bench.demands };
        let turning = Bench::new(bench.document, bench.motor, &demands, bench.work);
        all.extend(turning.alternative(Way::Alignment, Setting::plain(MethodName::DcAlignment))?);
    }
    Ok(all)
}

impl Bench<'_> {
    /// Tries another way to start the motor. None if it cannot be set up or does not meet the demands of this bench.
    fn alternative(&self, way: Way, setting: Setting) -> Result<Option<Alternative>, SuitabilityError> {
        let trials = if way == Way::Alignment { SLOW_STARTS } else { STARTS };
        let starts = match self.starts(&setting, self.last_rotor(), SEARCH, trials) {
            Err(SuitabilityError::File(_)) => return Ok(None),
            starts => starts?,
        };
        let Ok(starts) = starts else { return Ok(None) };
        let is_kept = self.objections(&[&starts]).is_empty();
        Ok(is_kept.then_some(Alternative { way, setting, starts: starts.summary }))
    }
}
