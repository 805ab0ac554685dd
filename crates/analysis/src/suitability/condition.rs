//! What a verdict rests on that the data sheet does not say.

use standstill_detect::MethodName;
use standstill_plant::{Motor, PoleKnowledge};
use standstill_quantity::Quantity;
use standstill_quantity::unit::Share;
use standstill_scenario::{Document, Origin};

use super::bench::{Bench, Setting};
use super::margins::Margins;
use super::{Demands, Progress, SuitabilityError};

/// What must hold of the motor for the verdict to hold.
#[derive(Clone, Debug, PartialEq)]
pub enum Condition {
    /// Its saturation, which the sheet does not give, is at least this.
    Saturation {
        /// By what share L_d falls at rated current along +d.
        least: f64,
        /// By what share it then falls along −d, in iron that saturates alike either way; negative where it grows.
        minus_d: f64,
    },
    /// Its map, which has one side of the d-axis only, tells the pole after all.
    Pole,
}

/// Falls of L_d between which the least that suffices is looked for.
const RANGE: [f64; 2] = [0.005, 0.4];
/// How finely.
const FINENESS: f64 = 1.08;
/// Starts of a look.
const LOOK: u64 = 64;

/// A document whose motor saturates by this share along +d, with the motor. None where the sheet has no such key.
pub(super) fn saturating(document: &Document, share: f64) -> Option<(Document, Motor)> {
    let mut document = document.clone();
    let value = format!("{} %", standstill_quantity::rounded(share, 2));
    document.set_value(KEY, value.into(), Origin::CommandLine).ok()?;
    let motor = document.motor().ok()?;
    (motor.pole_knowledge() == PoleKnowledge::Known).then_some((document, motor))
}

/// The key of the saturation of a sheet by its nameplate.
pub(super) const KEY: &str = "motor.nameplate.saturation";

/// The least fall of L_d at which some method answers, in two digits, rounded up; none where the largest does not suffice.
pub(super) fn least_saturation(
    document: &Document,
    demands: &Demands,
    methods: &[MethodName],
    hear: &mut dyn FnMut(Progress<'_>),
) -> Result<Option<f64>, SuitabilityError> {
    let mut suffices = |share: f64| -> Result<bool, SuitabilityError> {
        hear(Progress::Saturation(share));
        let Some((document, motor)) = saturating(document, share) else { return Ok(false) };
        let bench = Bench::new(&document, &motor, demands);
        for method in methods {
            if bench.answers(*method)? {
                return Ok(true);
            }
        }
        Ok(false)
    };
    let [mut low, mut high] = RANGE;
    if !suffices(high)? {
        return Ok(None);
    }
    if suffices(low)? {
        return Ok(Some(low));
    }
    while high / low > FINENESS {
        let middle = (low * high).sqrt();
        if suffices(middle)? { high = middle } else { low = middle }
    }
    Ok(Some(rounded_up(high)))
}

/// To two digits.
pub(super) fn rounded_up(share: f64) -> f64 {
    let power = standstill_quantity::magnitude(share).unwrap_or(0) - 1;
    let digits = standstill_quantity::rounded(share, -power);
    standstill_quantity::rounded((digits - 1e-9).ceil(), power)
}

/// By what share L_d falls at rated current along −d, as the data sheet assumes it.
pub(super) fn minus_d(document: &Document) -> Result<f64, SuitabilityError> {
    let sheet = document.data_sheet()?;
    let entries = sheet.entries();
    let entry = entries.iter().find(|entry| entry.key == "nameplate.saturation.minus_d");
    let share = entry.and_then(|entry| entry.value.parse::<Quantity<Share>>().ok());
    Ok(share.map_or(f64::NAN, Quantity::value))
}

/// Methods that are asked: those whose detection is short.
const QUICK: [MethodName; 3] =
    [MethodName::Bipolar, MethodName::LineInductanceFast, MethodName::MaximumLikelihood];

/// Those of the methods; all of them where none is.
pub(super) fn quick(methods: &[MethodName]) -> Vec<MethodName> {
    let quick: Vec<MethodName> = methods.iter().copied().filter(|method| QUICK.contains(method)).collect();
    if quick.is_empty() { methods.to_vec() } else { quick }
}

impl Bench<'_> {
    /// Whether a method answers with the strongest pulses or vectors that are allowed.
    fn answers(&self, method: MethodName) -> Result<bool, SuitabilityError> {
        if self
            .scenario(&Setting::plain(method), self.rotors[0], false)
            .is_err_and(|error| error.is_foreign_setting())
        {
            return Ok(false);
        }
        for setting in self.strongest(method)? {
            let enough = |margins: &Margins| margins.is_kept() && margins.pole.is_none_or(|pole| pole > 1.05);
            if self.look(setting, LOOK)?.is_some_and(|look| enough(&look.margins)) {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
