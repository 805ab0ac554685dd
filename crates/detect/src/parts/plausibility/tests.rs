use standstill_interface::{Abc, Nanos, Sensed};

use super::*;
use crate::testing::PLATE;

fn limits() -> PlausibilitySettings<f64> {
    PlausibilitySettings::suited(&PLATE)
}

/// Checks currents in A at the end of a pulse from a to b, on a link of this voltage in V.
fn pulse(
    limits: &PlausibilitySettings<f64>,
    current: [f64; 3],
    link: f64,
    sensed: [Sensed; 3],
) -> Result<(), Fault<f64>> {
    let reading = Reading { sensed: Abc(sensed), ..Reading::measured(Nanos::ZERO, current, link) };
    let [a, b, c] = current;
    let mut margin = Margin::new();
    limits.link(&mut margin, &reading)?;
    limits.sum(&mut margin, &reading, (a, -b), c, 0.175 + limits.sensors * a.abs().max(b.abs()))
}

#[test]
fn law_currents_that_sum_to_zero_are_those_of_whole_sensors() {
    let limits = limits();
    let three = [Sensed::Measured; 3];
    let two = [Sensed::Measured, Sensed::Measured, Sensed::Derived];
    assert_eq!(pulse(&limits, [3.5, -3.5, 0.0], 540.0, three), Ok(()));
    // Gains apart by three deviations each way, and noise.
    assert_eq!(pulse(&limits, [3.55, -3.45, 0.02], 540.0, three), Ok(()));
    // A dead sensor, a reversed one, two exchanged, one that shows a current where none can flow.
    for wrong in [[3.5, 0.0, 0.0], [3.5, 3.5, 0.0], [3.5, 0.0, -3.5], [3.5, -3.5, 2.0]] {
        assert!(
            matches!(pulse(&limits, wrong, 540.0, three), Err(Fault::SensorsDisagree { .. })),
            "{wrong:?}"
        );
    }
    // What is derived from two sensors cannot disagree with them.
    assert_eq!(pulse(&limits, [3.5, -3.5, 2.0], 540.0, two), Ok(()));
    // With a large saliency diodes of the third leg may carry a part: the sum counts alone.
    let salient = PlausibilitySettings::suited(&Nameplate { q_axis_inductance: 30e-3, ..PLATE });
    assert_eq!(pulse(&salient, [3.5, -3.0, -0.5], 540.0, three), Ok(()));
    assert!(pulse(&limits, [3.5, -3.0, -0.5], 540.0, three).is_err());
    assert!(pulse(&salient, [3.5, -3.0, 0.0], 540.0, three).is_err());
}

#[test]
fn law_a_link_beyond_its_data_sheet_is_one_of_a_wrong_sensor() {
    for (link, holds) in [(540.0, true), (400.0, true), (340.0, false), (700.0, true), (740.0, false)] {
        let found = pulse(&limits(), [3.5, -3.5, 0.0], link, [Sensed::Measured; 3]);
        assert_eq!(found.is_ok(), holds, "{link} V: {found:?}");
        assert!(holds || matches!(found, Err(Fault::DcLinkOutOfRange { .. })));
    }
}

#[test]
fn law_lines_are_those_of_the_data_sheet_within_a_third() {
    let (limits, train) = (limits(), PulseTrainSettings::suited(&PLATE, Nanos::from_micros(50)));
    let check = |lines| limits.lines(&mut Margin::new(), lines, &train);
    // L_d + L_q = 28 mH, and its ends, 20 and 36 mH.
    assert_eq!(check([[28e-3; 2], [20e-3; 2], [36e-3; 2]]), Ok(()));
    // A data sheet that is ten per cent off.
    assert_eq!(check([[18e-3; 2], [39.6e-3; 2], [28e-3; 2]]), Ok(()));
    for wrong in [10e-3, 60e-3, -1e-3, f64::NAN] {
        let found = check([[28e-3; 2], [wrong; 2], [28e-3; 2]]);
        let of_line = matches!(found, Err(Fault::InductanceOutOfRange { phase: Phase::B, .. }));
        assert!(of_line, "{wrong}: {found:?}");
    }
    // The poles may differ by a tenth and twice their difference at rated current, 30 %.
    assert_eq!(check([[24.5e-3, 31.5e-3], [28e-3; 2], [28e-3; 2]]), Ok(()));
    let found = check([[23e-3, 33e-3], [28e-3; 2], [28e-3; 2]]);
    assert!(matches!(found, Err(Fault::DirectionsDiffer { phase: Phase::A, .. })), "{found:?}");
}
