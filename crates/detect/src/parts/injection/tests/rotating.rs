use super::*;

/// The answer to a current whose part that turns backwards is `ratio` times as large as the one that turns with the voltage, along `line`
/// in radians.
fn of_ellipse(s: &InjectionSettings<f64>, ratio: f64, line: f64) -> Result<Angle<f64>, Fault<f64>> {
    axis(&mut Rotating::new(), s, &mut Findings::default(), |_, clock| {
        let phase = times(s.phase_read(clock), turn(-1.1));
        let backwards = times(turn(2.0 * line), AlphaBeta::new(phase.alpha, -phase.beta));
        phase + backwards * ratio
    })
}

/// Without one phase the same current flows through both others, to and fro: `i = ℓ cos(ωt − φ)` along the line ℓ of these two, whatever
/// the rotor's angle. With `ℓ = e^{jγ}` that is `½ e^{jγ} (e^{j(ωt − φ)} + e^{−j(ωt − φ)})`: both parts are equally large.
#[test]
fn analytic_a_current_of_two_phases_is_no_axis() {
    for (d, q) in [(10e-3, 17e-3), (17e-3, 10e-3), (10e-3, 10.8e-3), (2e-3, 10e-3)] {
        let s = RotatingInjectionSettings::suited(&nameplate(d, q)).0;
        let known = (q - d).abs() / (q + d);
        for line in [30.0_f64, 90.0, 150.0] {
            let Err(Fault::NoCurrent { peak, needed }) = of_ellipse(&s, 1.0, line.to_radians()) else {
                panic!("a line along {line}°")
            };
            assert!(peak.abs() < 1e-12 && (needed - (1.0 - known) / 3.0).abs() < 1e-12, "{peak} {needed}");
            // A third of the width that the data sheet's inductances give is enough.
            let with = |width: f64| of_ellipse(&s, 1.0 - (1.0 - known) * width, line.to_radians());
            assert!(matches!(with(0.32), Err(Fault::NoCurrent { .. })));
            assert!(with(0.34).is_ok() && with(1.0).is_ok(), "{d} {q}");
        }
    }
}
