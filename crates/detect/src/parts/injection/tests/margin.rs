use super::*;

#[test]
fn law_the_margin_is_that_of_the_polarity_test_once_it_runs() {
    let s = InjectionSettings { ramp: 3, cycles: 4, ..InjectionSettings::suited(&nameplate(10e-3, 17e-3)) };
    let mut detector = Injection::<f64, Probe>::new(InjectionMethod(s, PhantomData)).expect("settings");
    let reading = Reading::measured(Nanos::ZERO, [0.1, -0.05, 0.02], 540.0);
    let (mut count, mut before) = (0, None);
    // Vectors without an answer.
    let fault = loop {
        let command = match detector.next(&[reading; 64][..count]) {
            Ok(Step::Drive(command)) => command,
            Ok(Step::Done(outcome)) => panic!("{outcome:?}"),
            Err(fault) => break fault,
        };
        count = usize::try_from(command.sampling.count).expect("few");
        if matches!(detector.state, State::Measuring) {
            before = detector.so_far().1.smallest();
        }
    };
    assert!(matches!(fault, Fault::NoCurrent { .. }), "{fault:?}");
    let after = detector.so_far().1.smallest();
    assert!(after < before, "{before:?} {after:?}");
}
