//! Conditions of a verdict that depends on values missing in the data sheet.

use standstill_detect::MethodName;
use standstill_plant::{MAGNETS_INSIDE_FROM, Motor, PoleKnowledge, fall_of_surface_magnets};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Share;
use standstill_scenario::{Document, Origin};

use super::bench::{Bench, Look, Setting};
use super::margins::Margins;
use super::work::Allowance;
use super::{Demands, Progress, Suitability, SuitabilityError};

/// Condition that the motor must fulfil so that the verdict is valid.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// The motor's saturation, which the data sheet does not give, lies in this range.
    Saturation {
        /// Smallest allowed fall of L_d at rated current along +d, as a share of L_d.
        least: f64,
        /// Largest allowed fall of L_d at rated current along +d, as a share of L_d. The settings suffice at both ends of the range.
        most: f64,
        /// Fall of L_d at rated current along −d, as a share of L_d, at the smallest saturation. It is computed for iron that saturates
        /// equally in both directions, and is negative if L_d rises.
        minus_d: f64,
    },
    /// The motor's flux map, which covers only one side of the d-axis, predicts the pole correctly.
    Pole,
}

/// Smallest tried fall of L_d, as a share of L_d.
const SMALLEST: f64 = 0.005;
/// Upper ends of the ranges of saturation, as falls of L_d, in the order in which they are tried. The first range with an answer is taken.
const LARGEST: [f64; 4] = [0.15, 0.3, 0.4, 0.08];
/// Ratio of upper to lower end of the bracket around the smallest sufficient fall of L_d. The search stops when it is reached.
const FINENESS: f64 = 1.08;
/// Number of simulated motor starts by which settings are judged.
const LOOK: u64 = 64;
/// Number of starts of a cheaper trial that precedes the trial with [`LOOK`] starts.
const FEW: u64 = 16;
/// Pole evidence in units of the evidence that a decision needs. Settings whose few starts show less are dropped.
const HOPELESS: f64 = 0.6;
/// Pole evidence that settings must show to suffice, in units of the evidence that a decision needs.
const ENOUGH: f64 = 1.05;
/// Share of the pole evidence that other, insufficient settings showed in many starts. Settings whose few starts show less than this share
/// are dropped.
const FEW_TO_MANY: f64 = 0.85;
/// Number of search steps whose saturation is predicted from the pole evidence. Later steps bisect the range.
const PREDICTED: u32 = 6;

/// Share of the remaining work for the search of the smallest sufficient saturation. The rest is for the confirmation of its settings.
const NARROWING: f64 = 0.7;
/// Largest accepted ratio of the lower to the upper end of a range of saturation. A narrower range is of no use, because no data sheet
/// shows that a motor lies in it.
const NARROWEST: f64 = 0.8;
/// Factor by which the smallest saturation that suffices on few starts is raised if there is too little work for many starts.
const COMFORT: f64 = 1.15;

/// Returns the upper ends of the ranges of saturation for a motor, in the order in which they are tried. A range that contains the estimate
/// of [`fall_of_surface_magnets`] comes first.
pub(super) fn upper_ends(motor: &Motor) -> Vec<f64> {
    let winding = &motor.winding;
    let is_round = winding.q_axis_inductance() < MAGNETS_INSIDE_FROM * winding.d_axis_inductance();
    let estimate = fall_of_surface_magnets(motor).filter(|_| is_round).map(rounded_up);
    estimate.filter(|fall| *fall > LARGEST[0]).into_iter().chain(LARGEST).collect()
}

/// Returns a document and its motor. The motor's L_d falls by this share at rated current along +d. None if the data sheet has no key for
/// saturation.
pub(super) fn saturating(document: &Document, share: f64) -> Option<(Document, Motor)> {
    let mut document = document.clone();
    let value = format!("{} %", standstill_quantity::rounded(share, 2));
    document.set_value(KEY, value.into(), Origin::CommandLine).ok()?;
    let motor = document.motor().ok()?;
    (motor.pole_knowledge() == PoleKnowledge::Known).then_some((document, motor))
}

/// Path of the saturation key in a data sheet that is given by nameplate.
pub(super) const KEY: &str = "motor.nameplate.saturation";

/// Calls `ask` with the bench of a range of saturation, from `least` to `most`, and returns the result. None if the data sheet has no key
/// for saturation.
pub(super) fn with_range<T>(
    document: &Document,
    demands: &Demands,
    work: &Allowance,
    [least, most]: [f64; 2],
    mut ask: impl FnMut(&Bench<'_>) -> Result<T, SuitabilityError>,
) -> Result<Option<T>, SuitabilityError> {
    let [lower, upper] = [least, most].map(|share| saturating(document, share));
    let (Some((lower, lower_motor)), Some((upper, upper_motor))) = (lower, upper) else { return Ok(None) };
    let mut end = Bench::new(&upper, &upper_motor, demands, work);
    end.most_saturation = Some(most);
    let mut bench = Bench::new(&lower, &lower_motor, demands, work);
    bench.upper_end = (most > least).then_some(&end);
    ask(&bench).map(Some)
}

/// Finds the smallest fall of L_d at which the settings of a method meet the demands, if they also meet them at `most`. Returns the fall,
/// rounded up to two digits, and the settings. None if no settings suffice at `most`. If the work is used up, returns the smallest
/// sufficient fall found so far.
pub(super) fn least_saturation(
    document: &Document,
    demands: &Demands,
    work: &Allowance,
    methods: &[MethodName],
    most: f64,
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<(f64, Setting)>, SuitabilityError> {
    // The current is largest at the largest fall of L_d: pulses that keep the limit there keep it in the whole range.
    let strongest = with_range(document, demands, work, [most; 2], |bench| {
        let mut all = Vec::new();
        for method in methods {
            match bench.scenario(&Setting::plain(*method), bench.rotors[0]) {
                Err(error) if error.is_foreign_setting() => {}
                _ => all.extend(bench.strongest(*method)?),
            }
        }
        Ok(all)
    })?;
    let Some(strongest) = strongest else { return Ok(None) };
    let mut settings: Vec<Tried> = strongest.into_iter().map(Tried::new).collect();
    let mut ask = |share: f64| -> Result<Sufficiency, SuitabilityError> {
        hear(Progress::Saturation(share));
        let answer =
            with_range(document, demands, work, [share, most], |bench| bench.answers(&mut settings, share))?;
        Ok(answer.unwrap_or_default())
    };
    let mut seen = ask(most)?;
    let Some(mut sufficing) = seen.sufficing.take() else { return Ok(None) };
    // The last share that was tried, and the ends of the range that contains the smallest sufficient share; the lower end was not tried
    // yet.
    let (mut tried, [mut low, mut high], mut low_is_tried) = (most, [SMALLEST, most], false);
    let mut steps = 0..PREDICTED;
    while !(work.is_cut() || low_is_tried && high <= low * FINENESS) {
        let middle = (low * high).sqrt();
        let lowest = if low_is_tried { low * FINENESS.sqrt() } else { low };
        tried = if high <= low * FINENESS {
            low
        } else if seen.evidence > 0.1 && steps.next().is_some() {
            // The poles' currents differ in proportion to the fall of L_d, and so does the evidence.
            (ENOUGH * tried / seen.evidence).clamp(lowest, high / FINENESS.sqrt())
        } else {
            middle
        };
        seen = ask(tried)?;
        match seen.sufficing.take() {
            None => (low, low_is_tried) = (tried, true),
            Some(setting) => (high, sufficing) = (tried, setting),
        }
        if high <= low {
            return Ok(Some((low, sufficing)));
        }
    }
    Ok(Some((rounded_up(high), sufficing)))
}

/// Settings that are being tried. `evidence` has the saturation of their last trial and the pole evidence of this trial, in units of the
/// evidence that a decision needs.
pub(super) struct Tried {
    setting: Setting,
    evidence: Option<(f64, f64)>,
}

impl Tried {
    pub(super) const fn new(setting: Setting) -> Self {
        Self { setting, evidence: None }
    }

    /// Returns the pole evidence that the settings are expected to show at a saturation. It is proportional to the saturation. For settings
    /// that were never tried, it is just enough.
    fn expected(&self, share: f64) -> f64 {
        self.evidence.map_or(ENOUGH, |(at, evidence)| evidence * share / at)
    }
}

/// Result of the trial of settings at one saturation.
#[derive(Default)]
pub(super) struct Sufficiency {
    /// Settings that meet the demands. None without such settings.
    pub sufficing: Option<Setting>,
    /// Largest pole evidence of the tried settings, in units of the evidence that a decision needs.
    evidence: f64,
}

/// Rounds up to two significant digits.
pub(super) fn rounded_up(share: f64) -> f64 {
    let power = standstill_quantity::magnitude(share).unwrap_or(0) - 1;
    let digits = standstill_quantity::rounded(share, -power);
    standstill_quantity::rounded((digits - 1e-9).ceil(), power)
}

/// Returns the fall of L_d at rated current along −d, as a share of L_d, under the assumptions of the data sheet.
pub(super) fn minus_d(document: &Document) -> Result<f64, SuitabilityError> {
    let sheet = document.data_sheet()?;
    let entries = sheet.entries();
    let entry = entries.iter().find(|entry| entry.key == "nameplate.saturation.minus_d");
    let share = entry.and_then(|entry| entry.value.parse::<Quantity<Share>>().ok());
    Ok(share.map_or(f64::NAN, Quantity::value))
}

/// Methods with short detections. The search of the smallest saturation tries them.
pub(super) const QUICK: [MethodName; 5] = [
    MethodName::Bipolar,
    MethodName::MaximumLikelihood,
    MethodName::LineInductanceFast,
    MethodName::OpenTerminal,
    MethodName::SixPulse,
];

/// Returns the methods with short detections, or all methods if none of them has short detections.
pub(super) fn quick(methods: &[MethodName]) -> Vec<MethodName> {
    let quick: Vec<MethodName> = methods.iter().copied().filter(|method| QUICK.contains(method)).collect();
    if quick.is_empty() { methods.to_vec() } else { quick }
}

impl Bench<'_> {
    /// Finds settings that meet the demands at the saturation `share`. The most promising settings are tried first. Settings are dropped
    /// after few starts if their pole evidence is far too small, or clearly smaller than that of settings that did not suffice.
    pub(super) fn answers(
        &self,
        settings: &mut [Tried],
        share: f64,
    ) -> Result<Sufficiency, SuitabilityError> {
        let enough = |margins: &Margins| margins.is_kept() && margins.pole.is_none_or(|pole| pole > ENOUGH);
        settings.sort_by(|a, b| b.expected(share).total_cmp(&a.expected(share)));
        let mut seen = Sufficiency::default();
        'settings: for tried in settings {
            let setting = self.signed(tried.setting.clone())?;
            let Some(few) = self.look(setting.clone(), FEW)? else { continue };
            if let Some(pole) = few.margins.pole {
                tried.evidence = Some((share, pole));
                if pole < HOPELESS.max(FEW_TO_MANY * seen.evidence) {
                    seen.evidence = seen.evidence.max(pole);
                    continue;
                }
            }
            for bench in self.ends() {
                let Some(Look { margins, .. }) = bench.look(setting.clone(), LOOK)? else {
                    continue 'settings;
                };
                // The less the core saturates, the less the poles differ: the lower end has the least evidence.
                if let (Some(pole), None) = (margins.pole, bench.most_saturation) {
                    tried.evidence = Some((share, pole));
                    seen.evidence = seen.evidence.max(pole);
                }
                if !enough(&margins) {
                    continue 'settings;
                }
            }
            return Ok(Sufficiency { sufficing: Some(setting), ..seen });
        }
        Ok(seen)
    }
}

impl Suitability {
    /// Checks a motor whose saturation is not given. Finds the smallest saturation, up to `most`, with which the motor meets the demands.
    /// None if it does not meet them even with `most`, or if the allowed work is used up.
    pub(super) fn with_saturation(
        document: &Document,
        demands: &Demands,
        work: &Allowance,
        methods: &[MethodName],
        most: f64,
        hear: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Option<Self>, SuitabilityError> {
        let (least, cut) =
            work.within(NARROWING, || least_saturation(document, demands, work, methods, most, hear));
        let Some((mut least, setting)) = least? else {
            return Ok(None);
        };
        if least > NARROWEST * most {
            return Ok(None);
        }
        let is_dear = with_range(document, demands, work, [least, most], |bench| bench.is_dear(&setting))?;
        let is_dear = is_dear == Some(true);
        if is_dear {
            // With evidence that is just enough, the confirmation would need more fresh starts than there is work for.
            least = rounded_up(COMFORT * least).min(NARROWEST * most);
        }
        let smaller = (cut || is_dear)
            .then(|| format!("a saturation of less than {} %", standstill_quantity::rounded(least, 2)));
        // Settings that few starts accept may need a little more saturation on many starts.
        for _ in 0..5 {
            let range = [least, most];
            let found = with_range(document, demands, work, range, |bench| {
                let (found, _) = Self::judged(bench, methods, Some(&setting), hear)?;
                Ok((found, minus_d(bench.document)?))
            })?;
            let Some((mut found, minus_d)) = found else { return Ok(None) };
            found.pole = PoleKnowledge::NotGiven;
            if found.recommended.is_some() {
                found.condition = Some(Condition::Saturation { least, most, minus_d });
                found.untried.extend(smaller);
                return Ok(Some(found));
            }
            if found.is_undecided {
                let share = standstill_quantity::rounded(least, 2);
                found
                    .untried
                    .push(format!("more fresh starts of a saturation of {share} %, which suffices in few"));
                return Ok(Some(found));
            }
            least = rounded_up(1.12 * least);
            if least > NARROWEST * most {
                break;
            }
        }
        Ok(None)
    }
}
