//! A law of iron that saturates late and steeply: nearly exponential in the flux.

use standstill_numeric::{exp, power};
use standstill_plant::{Algebraic, IronBridge};

/// Power W of the flux with which the inverse inductance grows. `(1 + t x)^W` is `e^(W t x)` within a few per cent where t x is small,
/// the exponential reluctivity of steel of Brauer (1975), <https://doi.org/10.1109/TMAG.1975.1058564>, as far as magnets bias it.
const POWER: u8 = 16;

/// Range of t, the inverse of the flux of the magnet through the iron in units of `L_d I`. Below it, the core is that of the series with
/// its square alone, above it both directions are alike.
const BIAS: [f64; 2] = [1e-3, 1e3];

/// Natural logarithm of t with which a search begins.
pub const BEGIN: f64 = -1.6;

/// Returns the core for inductances in H and a current I in A. The three numbers are the share by which the inverse of L_d grows from zero
/// current to the flux `L_d I` along +d; the natural logarithm of t; and the share by which the inverse of L_q grows to the flux `L_q I`
/// along q, besides what that flux adds to the iron's on the d-axis:
///
/// ```text
/// L_d di_d/dψ_d = 1 + c [(1 + t x)^W − 1],  x = δ_d/(L_d I),  on the d-axis
/// ```
///
/// with δ_d the flux linkage in Wb besides the magnet's. The iron is isotropic: it is driven by the flux's magnitude, whatever its direction.
/// Returns none if the first share is not positive or t is out of its range.
pub fn core([l_d, l_q]: [f64; 2], current: f64, [along, bias, across]: [f64; 3]) -> Option<Algebraic> {
    let bias = exp(bias);
    if along <= 0.0 || !(BIAS[0]..BIAS[1]).contains(&bias) {
        return None;
    }
    let share = along / (power(1.0 + bias, POWER) - 1.0);
    let units = [l_d * current, l_q * current];
    // The iron's flux at rest, of which δ_d is a share t x.
    let iron = units[0] / bias;
    let rest = 3.0 * units[0];
    let exponent = f64::from(POWER);
    let strength = share / (l_d * (exponent + 1.0) * power(iron, POWER));
    let q_share = (l_d / l_q) * (l_d / l_q);
    let own = (1.0 - share) / l_d;
    let at_rest = share / (l_d * (exponent + 1.0));
    let bridge = IronBridge { strength, saturation: 0.0, q_share, magnet_flux: rest - iron, exponent: POWER };
    Some(Algebraic {
        d: own,
        q: 1.0 / l_q - at_rest * q_share,
        qq: across / (3.0 * l_q * units[1] * units[1]),
        q_exponent: 2,
        magnet_current: own * rest + at_rest * iron,
        bridge: Some(bridge),
        ..Algebraic::default()
    })
}

#[cfg(test)]
mod tests {
    use standstill_interface::Dq;
    use standstill_numeric::Heading;
    use standstill_plant::{Core, MagneticCircuit};

    use super::*;

    /// Inverse inductances at zero current and at the fluxes of the definition, from the core's own derivatives.
    #[test]
    fn analytic_inverse_inductances_grow_by_the_shares_given() {
        let (l, current) = ([60e-6, 100e-6], 20.0);
        for (shares, t) in [([0.12, 0.05], 0.2), ([0.3, 0.0], 0.05), ([0.1, 0.02], 1.5)] {
            let algebraic =
                core(l, current, [shares[0], standstill_numeric::ln(t), shares[1]]).expect("a core");
            let circuit = MagneticCircuit::new(Core::Algebraic(algebraic)).expect("a circuit");
            let rest = 3.0 * l[0] * current;
            let at = |x: f64, y: f64| {
                let flux = Dq::new(rest + x * l[0] * current, y * l[1] * current);
                circuit.state(flux, Heading::ZERO)
            };
            let zero = at(0.0, 0.0);
            assert!(zero.current.d.abs() < 1e-9 * current && zero.current.q == 0.0, "{:?}", zero.current);
            let near =
                |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
            near(zero.inverse_inductance.xx * l[0], 1.0);
            near(zero.inverse_inductance.yy * l[1], 1.0);
            near(at(1.0, 0.0).inverse_inductance.xx * l[0], 1.0 + shares[0]);
            let share = shares[0] / (power(1.0 + t, POWER) - 1.0);
            near(at(-1.0, 0.0).inverse_inductance.xx * l[0], 1.0 + share * (power(1.0 - t, POWER) - 1.0));
            // The iron on the d-axis adds to the third.
            assert!(at(0.0, 1.0).inverse_inductance.yy * l[1] > 1.0 + shares[1]);
        }
        assert_eq!((core(l, current, [0.1, 8.0, 0.0]), core(l, current, [-0.1, BEGIN, 0.0])), (None, None));
    }

    /// With the same growth at ±L_d I, this law grows less at half of it than a square does: it is later and steeper.
    #[test]
    fn law_it_is_steeper_than_the_series() {
        let (along, t) = (0.12, 0.2);
        let c = along / (power(1.0 + t, POWER) - 1.0);
        let against = c * (power(1.0 - t, POWER) - 1.0);
        let half = c * (power(1.0 + 0.5 * t, POWER) - 1.0);
        // The series: 2 β x + 3 γ x² with the same values at ±1.
        let [linear, square] = [(along - against) / 2.0, (along + against) / 2.0];
        assert!(half < 0.9 * (0.5 * linear + 0.25 * square), "{half}");
    }
}
