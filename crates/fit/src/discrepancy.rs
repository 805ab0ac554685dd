//! Compares the estimates of the drive's parameters with the values that the fit began with.

use super::parameters::Parameter;
use super::result::Estimate;
use super::{Start, TWO_SIDED_95};

/// Least distance in standard deviations that is named: by chance alone one fit in 370 has it for a parameter.
const NAMED: f64 = 3.0;

/// Parameter of the drive whose estimate contradicts the initial value.
#[derive(Clone, Debug, PartialEq)]
pub struct Discrepancy {
    /// Name of the parameter, which is also that of its estimate.
    pub name: String,
    /// Unit of the value.
    pub unit: &'static str,
    /// Initial value in this unit.
    pub begun_with: f64,
    /// True if the initial value was stated; otherwise it is a guess.
    pub is_stated: bool,
    /// Estimate less initial value in standard deviations: those of the estimate for a stated value, and for a guess those of the
    /// difference of estimate and guess.
    pub deviations: f64,
}

/// Returns the parameters of the drive whose estimates contradict the initial values. `known_before` gives half the width of a
/// parameter's prior interval.
pub(super) fn discrepancies(
    estimates: &[Estimate],
    start: &Start,
    known_before: impl Fn(Parameter) -> f64,
) -> Vec<Discrepancy> {
    let devices = &start.devices;
    let of_drive = [
        (Parameter::DeadTime, start.dead_time),
        (Parameter::DiodeDrop, devices.diode_drop),
        (Parameter::SwitchDrop, devices.switch_drop),
        (Parameter::DiodeResistance, devices.diode_resistance),
    ];
    let contradicted = |(parameter, begun_with): (Parameter, f64)| {
        let name = parameter.name();
        let estimate = estimates.iter().find(|estimate| estimate.name == name && estimate.identified)?;
        let [low, high] = estimate.interval?;
        let is_stated = start.is_stated(&name);
        // Intervals need not lie alike to both sides of the value: the side of the initial value counts.
        let half = if begun_with < estimate.value { estimate.value - low } else { high - estimate.value };
        let before = if is_stated { 0.0 } else { known_before(parameter) };
        let deviations =
            TWO_SIDED_95 * (estimate.value - begun_with) / standstill_numeric::hypot(half, before);
        (deviations.abs() >= NAMED).then_some(Discrepancy {
            name,
            unit: estimate.unit,
            begun_with,
            is_stated,
            deviations,
        })
    };
    of_drive.into_iter().filter_map(contradicted).collect()
}

#[cfg(test)]
mod tests {
    use standstill_inverter::{DeviceKind, Devices};

    use super::*;

    fn found(stated: f64, is_stated: bool) -> Vec<Discrepancy> {
        let devices = Devices {
            kind: DeviceKind::Mosfet,
            switch_drop: 0.0,
            switch_resistance: 4e-3,
            diode_drop: stated,
            diode_resistance: 5e-3,
        };
        let stated = if is_stated { vec!["diode_drop".to_owned()] } else { Vec::new() };
        let (settle, most_used) = (0.0, crate::MOST_USED);
        let start = Start { motor: None, devices, dead_time: 1e-6, stated, settle, most_used };
        // One standard deviation below, two above.
        let one = Estimate {
            name: "diode_drop".to_owned(),
            unit: "V",
            value: 0.9,
            interval: Some([0.9 - 0.02 * TWO_SIDED_95, 0.9 + 0.04 * TWO_SIDED_95]),
            identified: true,
            at: None,
        };
        discrepancies(&[one], &start, |_| 0.1 * TWO_SIDED_95)
    }

    #[test]
    fn analytic_a_stated_drop_is_contradicted_by_so_many_deviations_of_the_estimate() {
        let one = &found(0.822, true)[0];
        assert!((one.deviations - 3.9).abs() < 1e-9 && one.is_stated, "{one:?}");
        assert!((found(1.056, true)[0].deviations + 3.9).abs() < 1e-9);
        assert_eq!(found(0.841, true), []);
        // A guessed drop is known to 0.1 V only.
        assert_eq!(found(0.822, false), []);
        let off = 3.5 * 0.02_f64.hypot(0.1);
        assert!((found(0.9 - off, false)[0].deviations - 3.5).abs() < 1e-9);
    }
}
