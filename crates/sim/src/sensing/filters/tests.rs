use super::*;

/// Returns the output of a filter with a time constant of 1 s after `h` seconds; its input is a cubic in time plus oscillations.
fn filtered(h: f64, start: f64, input: [f64; 4], rings: Option<Rings<'_, f64>>) -> f64 {
    let mut filters = Filters { rate: [1.0, 2.0, 0.5], output: [start; 3] };
    filters.advance(true, h, &[input, [0.0; 4], [0.0; 4]], rings);
    filters.output[0]
}

#[test]
fn analytic_what_a_filter_makes_of_powers_of_time() {
    for h in [1e-9_f64, 1e-4, 0.03, 0.5, 0.999, 1.001, 4.0, 50.0, 300.0] {
        let decay = (-h).exp();
        // τ y′ = x − y from rest: 1 − e^−t, t − (1 − e^−t), t² − 2 (t − 1 + e^−t), …; on short steps the leading terms.
        let mut exact = [1.0 - decay, 0.0, 0.0, 0.0];
        for n in 1..4 {
            let k = n as f64;
            exact[n] = if h < 0.1 {
                // ∫ e^(s − h) sⁿ ds, in powers of h.
                let mut term = h.powf(k + 1.0) / (k + 1.0);
                let mut sum = term;
                for j in 1..20 {
                    term *= -h / (k + 1.0 + f64::from(j));
                    sum += term;
                }
                sum
            } else {
                h.powf(n as f64) - k * exact[n - 1]
            };
        }
        exact[0] = -(-h).exp_m1();
        for n in 0..4 {
            let mut input = [0.0; 4];
            // The cubic's time is a share of the step, so that tⁿ is hⁿ sⁿ.
            input[n] = h.powf(n as f64);
            let off = filtered(h, 0.0, input, None) - exact[n];
            assert!(off.abs() < 3e-14 * exact[n].max(exact[0] * input[n] * 0.01), "{h} s, power {n}: {off}");
        }
        assert!((filtered(h, 3.0, [0.0; 4], None) - 3.0 * decay).abs() < 3e-13 * decay + 1e-27, "{h} s");
    }
}

#[test]
fn analytic_what_a_filter_makes_of_an_oscillation() {
    let none = Oscillation { phasor: [0.0; 2], turns: [0.0, 1.0], over: [1.0f64.cos(), 1.0f64.sin()] };
    for (h, decay, angle) in [(0.1, 0.2, 0.5), (2.0, 1.0, 7.0), (1e-3, 0.0, 0.1), (30.0, 0.5, 40.0)] {
        let over = f64::exp(-decay);
        let of = Oscillation {
            phasor: [0.7, -0.4],
            turns: [-decay, angle],
            over: [over * f64::cos(angle), over * f64::sin(angle)],
        };
        let wave = |s: f64| 0.3 * (-decay * s).exp() * (0.7 * (angle * s).cos() + 0.4 * (angle * s).sin());
        // Simpson's rule over e^(−h (1 − s)) h x(s).
        let parts = 20_000;
        let sum: f64 = (0..=parts)
            .map(|n| {
                let s = f64::from(n) / f64::from(parts);
                let weight = if n == 0 || n == parts { 1.0 } else { f64::from(2 + 2 * (n % 2)) };
                weight * (-h * (1.0 - s)).exp() * h * wave(s)
            })
            .sum::<f64>()
            / f64::from(3 * parts);
        let off = filtered(h, 0.0, [0.0; 4], Some((&[none, of], &[[1.0; 3], [0.3; 3]]))) - sum;
        assert!(off.abs() < 1e-12, "{h} s: {off}");
    }
}

#[test]
fn law_filters_follow_only_steps_that_were_taken() {
    let mut filters = Filters { rate: [1.0, 2.0, 3.0], output: [1.0, 2.0, 3.0] };
    filters.advance(false, 1.0, &[[5.0; 4]; 3], None);
    assert_eq!(filters.output, [1.0, 2.0, 3.0]);
    filters.put(0, [1.0, 2.0, 4.0]);
    assert_eq!(filters.output, [0.0; 3]);
    filters.advance(true, 1e-2, &[[1.0, 0.0, 0.0, 0.0]; 3], None);
    for (output, corner) in filters.output.into_iter().zip([1.0, 2.0, 4.0]) {
        let exact = 1.0 - (-std::f64::consts::TAU * corner * 1e-2_f64).exp();
        assert!((output - exact).abs() < 1e-15, "{corner} Hz: {output} {exact}");
    }
}
