use super::*;
use crate::nameplate::Place;

const SETTINGS: SettleSettings<f64> =
    SettleSettings { wait: Nanos(1000), threshold: 0.2, attempts: 2, place: Place::InLine };

fn reading(current: [f64; 3]) -> Reading<f64> {
    Reading::measured(Nanos::ZERO, current, 540.0)
}

#[test]
fn analytic_the_noise_is_that_of_one_reading() {
    let mut noise = Noise::new();
    assert_eq!(noise.deviation(), 0.0);
    // Differences of ±√2 σ, whatever the offsets.
    for sign in [1.0, -1.0, 1.0] {
        let d = sign * 0.1 * 2.0_f64.sqrt();
        noise.add(&[reading([0.5, -0.2, 0.1]), reading([0.5 + d, -0.2 - d, 0.1 + d])], Place::InLine);
    }
    assert!((noise.deviation() - 0.1).abs() < 1e-12);
}

#[test]
fn analytic_the_noise_of_the_link_is_that_of_one_reading_too() {
    let mut noise = Noise::new();
    // Differences of ±√2 σ, a hundredth of the link each.
    let at = |dc_link: f64| Reading { dc_link, ..reading([0.0; 3]) };
    for sign in [1.0, -1.0] {
        noise.add(&[at(540.0 * (1.0 - sign * 0.01 * 2.0_f64.sqrt())), at(540.0)], Place::InLine);
    }
    let (variance, freedom) = noise.of_link();
    assert!((variance - 1e-4).abs() < 1e-12 && freedom == 2.0, "{variance} {freedom}");
}

#[test]
fn law_waits_end_when_the_current_is_gone_and_slow_ones_are_released() {
    for fast in [true, false] {
        let mut settler = Settler::new(SETTINGS, fast);
        let leg = |command: &Command<f64>| command.stage.legs.0[0];
        let first = settler.begin();
        assert_eq!(leg(&first), if fast { Leg::Off } else { Leg::Low });
        assert_eq!((first.sampling.trigger(0), first.sampling.trigger(1)), (Nanos(800), Nanos(1000)));
        assert_eq!(settler.step(&[reading([0.3, 0.0, 0.0]), reading([0.0; 3])]), Ok(Some(first)));
        let end = [reading([0.1, 0.0, 0.0]), reading([0.19, -0.1, -0.09])];
        if !fast {
            let released = settler.step(&end).expect("quiet").expect("released");
            assert_eq!(leg(&released), Leg::Off);
        }
        assert_eq!(settler.step(&end), Ok(None));
        assert_eq!((settler.residual.0, settler.dc_link), ([0.19, -0.1, -0.09], 540.0));
    }
    let mut settler = Settler::new(SETTINGS, true);
    let _ = settler.begin();
    let loud = [reading([0.0, 0.3, 0.0]); 2];
    assert!(settler.step(&loud).is_ok());
    assert_eq!(settler.step(&loud), Err(Fault::CurrentPersists(0.3)));
}

#[test]
fn analytic_the_margin_of_a_wait_is_how_many_more_it_might_have_taken() {
    let margin_after = |fast: bool, currents: &[f64]| {
        let mut settler = Settler::new(SETTINGS, fast);
        let _ = settler.begin();
        for current in currents {
            let _ = settler.step(&[reading([0.0, *current, 0.0]); 2]);
        }
        settler.margin.smallest()
    };
    // Of two waits: a quarter of one, one and a quarter, two, two and a half.
    for (currents, margin) in
        [(&[0.05][..], 7.0), (&[0.3, 0.05], 0.6), (&[0.3, 0.2], 0.0), (&[0.3, 0.3], -0.2)]
    {
        let found = margin_after(false, currents).expect("a check");
        assert!((found - margin).abs() < 1e-12, "{currents:?} {found}");
    }
    assert_eq!(margin_after(true, &[0.3]), None);
    // With all gates off an offset stays, however long the wait: there is no step where it comes to the threshold of 0.2 A.
    for (offset, margin) in [(0.05, 3.0), (0.2 - 1e-9, 5e-9), (0.2, 0.0)] {
        let found = margin_after(true, &[offset]).expect("a check");
        assert!((found - margin).abs() < 1e-12, "{offset} {found}");
    }
    let beyond = margin_after(true, &[0.2 + 1e-9; 2]).expect("a check");
    assert!((-1e-8..0.0).contains(&beyond), "{beyond}");
}

#[test]
fn law_what_no_sensor_sees_is_neither_current_nor_offset_nor_noise() {
    let mut settler = Settler::new(SETTINGS, true);
    let _ = settler.begin();
    let hidden = |value: f64| {
        let mut reading = reading([0.1, value, -0.1]);
        reading.sensed.0[1] = Sensed::Hidden;
        reading
    };
    assert_eq!(settler.step(&[hidden(f64::NAN), hidden(77.0)]), Ok(None));
    assert_eq!(settler.residual.0, [0.1, 0.0, -0.1]);
    assert_eq!(settler.noise.deviation(), 0.0);
}

#[test]
fn law_readings_of_no_sensor_are_refused() {
    for value in [f64::NAN, f64::INFINITY, -2e9] {
        assert_eq!(seen(&reading([0.0, value, 0.0]), Phase::B), Err(Fault::NotANumber));
        assert_eq!(largest(&reading([0.0, 0.0, value])), Err(Fault::NotANumber));
        assert_eq!(link(&Reading { dc_link: value, ..reading([0.0; 3]) }), Err(Fault::NotANumber));
    }
    assert_eq!(link(&Reading { dc_link: 0.0, ..reading([0.0; 3]) }), Err(Fault::NotANumber));
    assert_eq!(link(&Reading { dc_link_clipped: true, ..reading([0.0; 3]) }), Err(Fault::DcLinkClipped));
    assert_eq!(seen(&reading([1.0, 2.0, 3.0]), Phase::B), Ok(2.0));
    assert!(SETTINGS.check().is_ok());
    assert!(SettleSettings { wait: Nanos(u64::MAX), ..SETTINGS }.check().is_err());
    assert!(SettleSettings { threshold: f64::INFINITY, ..SETTINGS }.check().is_err());
    assert!(SettleSettings { attempts: 0, ..SETTINGS }.check().is_err());
}

#[test]
fn law_one_shunt_in_the_link_stands_for_the_phases_that_it_hides() {
    let through = |current: f64| Reading {
        sensed: Abc([Sensed::Hidden; 3]),
        link_current: current,
        link_sensed: Sensed::Measured,
        ..reading([0.0; 3])
    };
    let mut settler = Settler::new(SettleSettings { place: Place::InLink, ..SETTINGS }, true);
    let first = settler.begin();
    // What diodes return is negative.
    assert_eq!(settler.step(&[through(-0.3), through(0.0)]), Ok(Some(first)));
    assert_eq!(settler.step(&[through(0.05), through(0.07)]), Ok(None));
    assert_eq!(settler.residual.0, [0.07; 3]);
    assert!((settler.noise.deviation() - 0.02 / 2.0_f64.sqrt()).abs() < 1e-12);
    assert_eq!(settler.noise.freedom(), 1.0);
    let hidden = Reading { link_sensed: Sensed::Hidden, ..through(0.0) };
    assert_eq!(settler.step(&[hidden; 2]), Err(Fault::LinkCurrentHidden));
}
