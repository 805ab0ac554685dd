//! Headers of columns: quantity, unit, and whether values are peak or rms.

use std::f64::consts::PI;

use schemars::JsonSchema;
use serde::Deserialize;

/// Quantity of a column, or of a block of a wide table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// i_d, i_q, ψ_d, ψ_q: their place among the four.
    Dq(usize),
    /// The current's amplitude.
    Amplitude,
    /// The current's angle from +d towards +q.
    AngleFromD,
    /// The current's angle from +q towards −d, as drives count their advance.
    AngleFromQ,
}

/// Names without case, blanks, dots, dashes and underscores.
const NAMES: [(Quantity, &str); 7] = [
    (Quantity::Dq(0), "id isd ids currentd dcurrent idcurrent daxiscurrent"),
    (Quantity::Dq(1), "iq isq iqs currentq qcurrent iqcurrent qaxiscurrent"),
    (Quantity::Dq(2), "psid psisd fluxd dflux fd lambdad phid fluxlinkaged daxisflux daxisfluxlinkage"),
    (Quantity::Dq(3), "psiq psisq fluxq qflux fq lambdaq phiq fluxlinkageq qaxisflux qaxisfluxlinkage"),
    (Quantity::Amplitude, "i is iamplitude iamp current currentamplitude iabs"),
    (Quantity::AngleFromD, "anglefromd angled currentanglefromd"),
    (Quantity::AngleFromQ, "anglefromq angleq currentanglefromq"),
];

const CURRENT: [(&str, f64); 4] = [("A", 1.0), ("mA", 1e-3), ("kA", 1e3), ("ampere", 1.0)];
const FLUX: [(&str, f64); 8] = [
    ("Wb", 1.0),
    ("mWb", 1e-3),
    ("uWb", 1e-6),
    ("µWb", 1e-6),
    ("Vs", 1.0),
    ("mVs", 1e-3),
    ("uVs", 1e-6),
    ("µVs", 1e-6),
];
const ANGLE: [(&str, f64); 5] =
    [("deg", PI / 180.0), ("°", PI / 180.0), ("degree", PI / 180.0), ("degrees", PI / 180.0), ("rad", 1.0)];

/// How a file counts currents and fluxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MapValues {
    /// Amplitude-invariant: the length of the vector is the peak value of a phase.
    Peak,
    /// The length of the vector is the rms value of a phase.
    Rms,
}

impl MapValues {
    /// Names of the two.
    pub const NAMES: [&str; 2] = ["peak", "rms"];

    /// Returns the quantity with this name.
    pub fn named(name: &str) -> Option<Self> {
        [Self::Peak, Self::Rms]
            .into_iter()
            .zip(Self::NAMES)
            .find(|(_, known)| *known == name)
            .map(|(it, _)| it)
    }
}

/// The header of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Column {
    pub(super) quantity: Quantity,
    /// Factor from the column's unit to SI.
    pub(super) scale: f64,
    /// Peak or rms, if the header states it.
    pub(super) values: Option<MapValues>,
}

impl Column {
    /// Reads a header such as `Id [A]`, `psi_d_mWb` or `i_q/A`; none for another quantity.
    ///
    /// # Errors
    /// A quantity of a map has a wrong unit; the error names right ones.
    pub(super) fn parse(header: &str) -> Result<Option<Self>, String> {
        let header = header.trim().trim_matches('"').trim();
        let lower = header.to_lowercase();
        let says = |words: &[&str]| words.iter().any(|word| lower.contains(word));
        let values = match (says(&["rms", "eff"]), says(&["peak", "pk", "ampl"])) {
            (true, _) => Some(MapValues::Rms),
            (false, true) => Some(MapValues::Peak),
            _ => None,
        };
        let (name, unit) = split(header);
        let Some(quantity) = known(name).or_else(|| known(header)) else { return Ok(None) };
        let unit = if known(name).is_some() { unit } else { None };
        let units: &[(&str, f64)] = match quantity {
            Quantity::Dq(0 | 1) | Quantity::Amplitude => &CURRENT,
            Quantity::Dq(_) => &FLUX,
            Quantity::AngleFromD | Quantity::AngleFromQ => &ANGLE,
        };
        let scale = match unit {
            None if units[0].0 == "deg" => None,
            None => Some(1.0),
            Some(unit) => {
                let unit = plain_unit(unit);
                units.iter().find(|(known, _)| *known == unit).map(|(_, scale)| *scale)
            }
        };
        let allowed = || units.iter().map(|(unit, _)| *unit).collect::<Vec<_>>().join(", ");
        scale.map(|scale| Some(Self { quantity, scale, values })).ok_or_else(allowed)
    }
}

fn known(name: &str) -> Option<Quantity> {
    let mut plain: String = name
        .to_lowercase()
        .chars()
        .filter(|c| !" _-.,'".contains(*c))
        .collect::<String>()
        .replace('ψ', "psi");
    plain = plain.replace('λ', "lambda").replace(['φ', 'ϕ'], "phi");
    for word in ["rms", "peak", "pk"] {
        plain = plain.strip_suffix(word).unwrap_or(&plain).to_owned();
    }
    NAMES.iter().find(|(_, names)| names.split(' ').any(|name| name == plain)).map(|(quantity, _)| *quantity)
}

/// Returns a unit without dots and without the words for peak and rms.
fn plain_unit(unit: &str) -> String {
    let mut plain: String = unit.chars().filter(|c| !" .·*_⋅".contains(*c)).collect();
    for word in ["rms", "peak", "pk", "eff"] {
        plain = plain.strip_suffix(word).unwrap_or(&plain).to_owned();
    }
    plain
}

/// Returns the name and unit: in brackets, behind a slash or `in`, or behind the last underscore or blank.
fn split(header: &str) -> (&str, Option<&str>) {
    for (open, close) in [('[', ']'), ('(', ')'), ('{', '}')] {
        if let Some((name, rest)) = header.split_once(open) {
            return (name, Some(rest.split(close).next().unwrap_or_default()));
        }
    }
    for between in ["/", " in "] {
        if let Some((name, unit)) = header.split_once(between) {
            return (name, Some(unit));
        }
    }
    match header.rsplit_once(['_', ' ']) {
        // `psi_d_rms` has no unit, and `i_d` none either.
        Some((name, unit)) if known(name).is_some() && !["rms", "peak", "pk"].contains(&unit) => {
            (name, Some(unit))
        }
        _ => (header, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn analytic_headers_say_quantity_and_unit() {
        for (header, place, scale) in [
            ("i_d_A", 0, 1.0),
            ("id_A", 0, 1.0),
            ("Id [A]", 0, 1.0),
            ("I_q (mA)", 1, 1e-3),
            ("iq", 1, 1.0),
            ("isq/kA", 1, 1e3),
            ("psi_d_Vs", 2, 1.0),
            ("\"Flux d [mWb]\"", 2, 1e-3),
            ("lambda_q [V·s]", 3, 1.0),
            ("ψ_q in mVs", 3, 1e-3),
            ("Fq", 3, 1.0),
        ] {
            let column = Column { quantity: Quantity::Dq(place), scale, values: None };
            assert_eq!(Column::parse(header), Ok(Some(column)), "{header}");
        }
        for header in ["T_Nm", "speed", "", "angle_deg", "gamma", "Ld [mH]"] {
            assert_eq!(Column::parse(header), Ok(None), "{header}");
        }
        assert!(Column::parse("i_d_Wb").is_err_and(|units| units == "A, mA, kA, ampere"));
        assert!(Column::parse("angle_from_d").is_err_and(|units| units.starts_with("deg")));
        for (header, values) in
            [("Id [Arms]", MapValues::Rms), ("id_rms", MapValues::Rms), ("iq_pk", MapValues::Peak)]
        {
            let column = Column::parse(header).expect("a unit").expect("a current");
            assert_eq!((column.scale, column.values), (1.0, Some(values)), "{header}");
        }
        let angle = Column::parse("angle_from_q [deg]").expect("a unit").expect("an angle");
        assert!(angle.quantity == Quantity::AngleFromQ && (angle.scale * 180.0 - PI).abs() < 1e-15);
    }
}
