//! How a pulsating injection finds and follows its axis.

use super::*;

#[test]
fn analytic_a_pulsating_injection_is_exact_also_with_wrong_inductances() {
    for (d, q) in MOTORS {
        let (y0, y1) = ((1.0 / d + 1.0 / q) / 2.0, (1.0 / d - 1.0 / q) / 2.0);
        for (wrong, measurements) in [(1.0, 1), (1.0, 6), (1.5, 6), (0.7, 6)] {
            let mut s = PulsatingInjectionSettings::suited(&nameplate(d, q)).0;
            s.iterations = measurements;
            s.d_axis_inductance *= wrong;
            s.q_axis_inductance *= wrong;
            for degrees in [0.0, 25.0, 60.0, 130.0, 179.0_f64] {
                let mut demodulator = Pulsating::new();
                let mut findings = Findings::default();
                let found = axis(&mut demodulator, &s, &mut findings, |demodulator, clock| {
                    // The direction of the voltage, from its largest in a cycle; flux in Wb at the end of the period.
                    let along = demodulator.voltage(&s, Clock { period: 0, cycle: 0 });
                    let along = along * (1.0 / along.norm());
                    let flux = along * (s.voltage / s.frequency() * s.phase(2 * clock.period + 2).beta);
                    let mirrored = AlphaBeta::new(flux.alpha, -flux.beta);
                    flux * y0 + times(turn(2.0 * degrees.to_radians()), mirrored) * y1
                });
                assert_axis(found.expect("salient"), degrees, 1e-9);
                let samples = f64::from(s.cycles) * f64::from(s.periods);
                // I_q = 2 δ V/ω Y1 for a small δ, with a noise of σ √(2/3) √(2/n).
                let slope = 2.0 * y1.abs() * s.voltage / s.frequency();
                let expected = 0.01 * (4.0 / 3.0 / samples).sqrt() / slope;
                let stated = findings.angle_deviation.expect("stated");
                assert!((stated / expected - 1.0).abs() < 1e-9, "{stated} {expected}");
            }
        }
    }
}

#[test]
fn analytic_a_pulsating_injection_follows_an_axis_that_moves() {
    for (d, q) in MOTORS {
        let y1 = (1.0 / d - 1.0 / q) / 2.0;
        let y0 = (1.0 / d + 1.0 / q) / 2.0;
        let s = PulsatingInjectionSettings::suited(&nameplate(d, q)).0;
        for (moved, after) in [(5.0_f64, 2), (-5.0, 2), (20.0, 3)] {
            let mut given = 0;
            let mut findings = Findings::default();
            let found = axis(&mut Pulsating::new(), &s, &mut findings, |demodulator, clock| {
                if (clock.period, clock.cycle) == (0, s.ramp) {
                    given += 1;
                }
                let degrees = 130.0 + if given > after { moved } else { 0.0 };
                let along = demodulator.voltage(&s, Clock { period: 0, cycle: 0 });
                let flux =
                    along * (s.voltage / s.frequency() * s.phase(2 * clock.period + 2).beta / along.norm());
                let mirrored = AlphaBeta::new(flux.alpha, -flux.beta);
                flux * y0 + times(turn(2.0 * degrees.to_radians()), mirrored) * y1
            });
            // δ = ½ atan2(sin 2δ, 1) leaves the third power of a small angle.
            assert_axis(found.expect("salient"), 130.0 + moved, f64::to_radians(0.1));
            assert_eq!(given, s.iterations, "{moved}");
        }
        // Three measurements at least: two of them show the way alone.
        let one = InjectionSettings { iterations: 1, ..s };
        let mut given = 0;
        let found = axis(&mut Pulsating::new(), &one, &mut Findings::default(), |demodulator, clock| {
            given += i32::from((clock.period, clock.cycle) == (0, s.ramp));
            let along = demodulator.voltage(&s, Clock { period: 0, cycle: 0 });
            let flux = along * (s.phase(2 * clock.period + 2).beta / along.norm());
            flux * y0 + times(turn(2.0 * 1.0), AlphaBeta::new(flux.alpha, -flux.beta)) * y1
        });
        assert_axis(found.expect("salient"), 1.0_f64.to_degrees(), 1e-9);
        assert_eq!(given, 3);
    }
}
