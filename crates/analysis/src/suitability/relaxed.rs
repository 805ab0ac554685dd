//! Relaxed demands under which a motor would be suited: computed from the margins of the tried settings and confirmed
//! on fresh starts.

use standstill_detect::MethodName;

use super::advice::Advice;
use super::bench::{Bench, Look};
use super::condition::rounded_up;
use super::margins::{Demand, room};
use super::search::{Found, is_slow};
use super::{Demands, Progress, SuitabilityError};

/// Largest error or movement, in degrees, with which an answer is useful.
const MOST_DEG: f64 = 30.0;
/// Longest detection, in s, with which an answer is useful.
const MOST_S: f64 = 20.0;
/// Number of tried settings. Settings that miss the demands by less are tried first.
const NEAREST: usize = 3;
/// Additional factors by which missed demands are relaxed. They are tried one after the other until fresh starts meet the relaxed demands.
const FURTHER: [f64; 4] = [1.05, 1.15, 1.3, 1.5];

/// Returns relaxed demands that some of the found settings meet on fresh starts. None if the settings miss the pole, give too few answers,
/// or would need demands at which an answer is useless.
pub(super) fn tried(
    bench: &Bench<'_>,
    methods: &[(MethodName, &Found)],
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<Advice>, SuitabilityError> {
    let quick = methods.iter().filter(|(method, _)| !is_slow(*method));
    let missed = |look| excess(look).filter(|excess| *excess > 0.0).map(|excess| (excess, look));
    let mut nearest: Vec<(f64, &Look)> =
        quick.flat_map(|(_, found)| &found.looks).filter_map(missed).collect();
    nearest.sort_by(|a, b| a.0.total_cmp(&b.0));
    for (_, look) in nearest.into_iter().take(NEAREST) {
        for factor in FURTHER {
            let demands = relaxed(bench, look, factor);
            let Some(words) = words(bench.demands, &demands) else { break };
            hear(Progress::Change(&words));
            let mut changed = Bench::new(bench.document, bench.motor, &demands, bench.work);
            changed.has_pole = bench.has_pole;
            if changed.confirm(&look.setting, 0)?.is_ok() {
                let helps = Some(look.setting.clone());
                return Ok(Some(Advice {
                    change: words,
                    keys: Vec::new(),
                    frees: Vec::new(),
                    demands: Some(demands),
                    helps,
                }));
            }
        }
    }
    Ok(None)
}

/// Returns by how much settings miss the demands that may be relaxed, as the sum of the logarithms of the margins. None if they miss a
/// demand that may not be relaxed. `look` has the results of a few starts with these settings.
fn excess(look: &Look) -> Option<f64> {
    let mut sum = 0.0;
    for (demand, margin) in look.margins.all() {
        let missed = room(demand) / margin;
        if missed > 1.0 {
            if matches!(demand, Demand::Pole | Demand::Answers) || !missed.is_finite() {
                return None;
            }
            sum += standstill_numeric::ln(missed);
        }
    }
    Some(sum)
}

/// Returns demands that the settings in `look` meet. Each missed demand is relaxed by the ratio by which it is missed, and by the
/// additional `factor`.
fn relaxed(bench: &Bench<'_>, look: &Look, factor: f64) -> Demands {
    let (mut demands, margins) = (*bench.demands, look.margins);
    let more = |allowed: f64, demand: Demand, margin: f64| {
        let missed = room(demand) / margin;
        // A value near its limit may exceed the limit on more starts.
        if missed * factor > 1.0 { rounded_up(allowed * missed.max(1.0) * factor) } else { allowed }
    };
    demands.error_deg = more(demands.error_deg, Demand::Error, margins.error);
    demands.movement_deg = more(demands.movement_deg, Demand::Movement, margins.movement);
    demands.time_s = more(demands.time_s, Demand::Time, margins.time);
    if margins.current < room(Demand::Current) {
        demands.current_a = Some(rounded_up(1.02 * bench.most_current / margins.current));
    }
    demands
}

/// Describes how the new demands differ from the old ones. None if they are equal, or if an answer is useless with the new ones.
fn words(old: &Demands, new: &Demands) -> Option<String> {
    if new.error_deg > MOST_DEG.max(old.error_deg)
        || new.movement_deg > MOST_DEG.max(old.movement_deg)
        || new.time_s > MOST_S
    {
        return None;
    }
    let mut parts = Vec::new();
    if new.error_deg != old.error_deg {
        parts.push(format!("an error of {}° allowed in 95 of 100 starts", new.error_deg));
    }
    if new.movement_deg != old.movement_deg {
        parts.push(format!("a movement of {}° allowed", new.movement_deg));
    }
    if let Some(current) = new.current_a.filter(|_| new.current_a != old.current_a) {
        parts.push(format!("{current} A allowed"));
    }
    if new.time_s != old.time_s {
        parts.push(format!("{} ms allowed", standstill_quantity::number(0, new.time_s * 1e3)));
    }
    (!parts.is_empty()).then(|| parts.join(" and "))
}
