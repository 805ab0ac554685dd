use standstill_inverter::{Bridge, DcLink, GateTiming, Inverter};
use standstill_plant::built_in;

use super::*;
use crate::SensorSettings;

/// More than a thousand events within a microsecond are chatter; spread over a longer time, any number of events is allowed.
#[test]
fn regress_events_are_counted_where_no_time_passes() {
    let motor = built_in("paper-5k5").expect("built in");
    let inverter = Inverter {
        bridge: Bridge::default(),
        gates: [GateTiming::default(); 3],
        link: DcLink::stiff(550.0),
        carrier_period: Nanos::from_micros(100),
    };
    let case = Case { start_angle: 0.35, ..Case::new(&motor, inverter) };
    // Returns the number of events until the error, with `apart` in ns between two events.
    let until_chatter = |apart: f64| {
        let mut bank: Bank<'_, f64> =
            Bank::like(&motor, &case.inverter, &SensorSettings::IDEAL, false, false);
        let mut control = Control::new(case.clone(), &mut bank, 0, None, false, Room::default());
        (1..=5000_u32).find(|_| {
            bank.here.time += apart;
            matches!(control.count_event(&bank), Err(RunError::Chatter(_)))
        })
    };
    assert_eq!(until_chatter(0.0), Some(MOST_EVENTS + 1));
    // More than a thousand within a microsecond, wherever it begins, are an error; ringing terminals have fewer.
    assert!(until_chatter(0.5).is_some_and(|count| count < 3 * MOST_EVENTS));
    assert_eq!(until_chatter(2.0), None);
    assert_eq!(until_chatter(100.0), None);
}
