//! Zeros of a function of one number.

/// Returns a zero of `f` between two places, at the lower of which it is at most zero and at the upper one at least:
/// to the last bits of the larger of both. None if `f` is none on the way.
///
/// By interpolation, truncation and projection (Oliveira and Takahashi, DOI 10.1145/3423597): as many evaluations as
/// halving at most, and one more; some ten where `f` is smooth.
///
/// ```
/// use standstill_numeric::root;
///
/// let square_root = root(0.0, 2.0, |x| Some(x * x - 2.0)).ok_or("none")?;
/// assert!((square_root - std::f64::consts::SQRT_2).abs() < 1e-15);
/// assert_eq!(root(0.0, 2.0, |_| None), None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn root(low: f64, high: f64, mut f: impl FnMut(f64) -> Option<f64>) -> Option<f64> {
    let (mut a, mut b) = (low, high);
    let (mut at_a, mut at_b) = (f(a)?, f(b)?);
    if at_a >= 0.0 {
        return Some(a);
    }
    if at_b <= 0.0 {
        return Some(b);
    }
    let exact = f64::EPSILON * a.abs().max(b.abs());
    // What halving would leave, and one halving more.
    let mut reach = exact;
    while reach < b - a {
        reach *= 2.0;
    }
    let truncation = 0.2 / (b - a);
    while b - a > 2.0 * exact {
        let middle = (a + b) / 2.0;
        let secant = (at_b * a - at_a * b) / (at_b - at_a);
        let towards = if secant > middle { -1.0 } else { 1.0 };
        let cut = truncation * (b - a) * (b - a);
        let near = if cut <= (middle - secant).abs() { secant + towards * cut } else { middle };
        let room = (reach - (b - a) / 2.0).max(0.0);
        let x = if (near - middle).abs() <= room { near } else { middle - towards * room };
        // Beside an end that is the zero already, or the other one would never come nearer.
        let x = x.max(a + exact).min(b - exact);
        let at_x = f(x)?;
        if at_x > 0.0 {
            (b, at_b) = (x, at_x);
        } else if at_x < 0.0 {
            (a, at_a) = (x, at_x);
        } else {
            return Some(x);
        }
        reach /= 2.0;
    }
    Some((a + b) / 2.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Zeros that are known, of functions that bend either way, are flat, jump, or have most of their room on one side.
    #[test]
    fn analytic_zeros_are_found_to_the_last_bits_in_few_evaluations() {
        type Case = (fn(f64) -> f64, [f64; 2], f64, u32);
        let cases: [Case; 7] = [
            (|x| x * x - 2.0, [0.0, 2.0], std::f64::consts::SQRT_2, 14),
            (|x| x - 0.3, [0.0, 1.0], 0.3, 14),
            (|x| x * x * x * x * x - 1e-10, [0.0, 1.0], 1e-2, 60),
            (|x| 1.0 - 1.0 / x, [1e-3, 1e3], 1.0, 60),
            (|x| (x - 0.5) * (x - 0.5) * (x - 0.5), [-10.0, 3.0], 0.5, 60),
            (|x| if x < 0.7 { -1.0 } else { 1e6 }, [0.0, 1.0], 0.7, 60),
            (|x| x + 2.0, [-5.0, 0.0], -2.0, 14),
        ];
        for (n, (f, [low, high], zero, most)) in cases.into_iter().enumerate() {
            let mut count = 0;
            let found = root(low, high, |x| {
                count += 1;
                Some(f(x))
            });
            let found = found.expect("a zero");
            let slack = if n == 4 { 1e-5 } else { 1e-15 * low.abs().max(high.abs()) };
            assert!((found - zero).abs() <= slack, "{n}: {found:e} and not {zero:e}");
            assert!(count <= most, "{n}: {count} evaluations");
        }
    }

    #[test]
    fn analytic_an_end_that_is_a_zero_is_the_answer() {
        assert_eq!(root(0.0, 1.0, Some), Some(0.0));
        assert_eq!(root(0.0, 1.0, |x| Some(x - 1.0)), Some(1.0));
        assert_eq!(root(0.0, 1.0, |x| (x < 0.5).then_some(-1.0)), None);
    }
}
