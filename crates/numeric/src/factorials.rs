//! Reciprocal factorials: the coefficients of exponentials, sines and related functions.

/// 1/n! for n up to 24.
///
/// ```
/// use standstill_numeric::PER_FACTORIAL;
/// assert_eq!(PER_FACTORIAL[4], 1.0 / 24.0);
/// ```
pub const PER_FACTORIAL: [f64; 25] = {
    let mut all = [1.0; 25];
    // A factorial itself is a whole number, exact up to 22!.
    let (mut n, mut factorial) = (1, 1.0);
    while n < 25 {
        factorial *= n as f64;
        all[n] = 1.0 / factorial;
        n += 1;
    }
    all
};
