//! Saturation of the d-axis as published, for motors whose data sheets state none.
//!
//! Two data sheets of this repository state the saturation by their sources. Two flux maps are public. From that of
//! Toyota's Prius, the column `Lmidd` at i_q = 0 is used unchanged. From that of a finite-element example, fluxes along
//! d at i_q = 0 are averaged over the rotor's angle and differenced over 60 A. No data were found for motors with
//! surface magnets; what their saliency implies is computed.

use standstill_numeric::{power, root};

use crate::Motor;

/// Fall of the incremental inductance along the d-axis at one current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedFall {
    /// Current in A.
    pub current: f64,
    /// Share by which L_d is smaller than without current at this current along +d; negative if it is larger.
    pub along: f64,
    /// Share by which L_d is smaller than without current at this current along −d; negative if it is larger.
    pub against: f64,
}

/// Published saturation of one motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PublishedSaturation {
    /// Description of the motor.
    pub motor: &'static str,
    /// Falls in order of the current.
    pub falls: &'static [PublishedFall],
    /// Source of the numbers.
    pub source: &'static str,
}

const fn at(current: f64, along: f64, against: f64) -> PublishedFall {
    PublishedFall { current, along, against }
}

/// Motors with magnets inside of the rotor.
pub const PUBLISHED_SATURATION: [PublishedSaturation; 4] = [
    PublishedSaturation {
        motor: "5.5 kW on mains",
        falls: &[at(8.0, 0.063, -0.034)],
        source: "Chen and Tao 2019, Table 2",
    },
    PublishedSaturation {
        motor: "car, Toyota Prius",
        falls: &[at(50.0, -0.37, 0.04), at(100.0, 0.48, 0.08), at(200.0, 0.72, 0.19)],
        source: "look_up_table_based_pmsm_prius_motor_data.mat of PLECS",
    },
    PublishedSaturation {
        motor: "8 poles, by finite elements",
        falls: &[at(90.0, 0.42, 0.06), at(150.0, 0.76, 0.14)],
        source: "ee_ece_table.m of Simscape Electrical",
    },
    PublishedSaturation {
        motor: "5.5 kW, magnet-assisted reluctance",
        falls: &[at(8.8, 0.27, 0.35)],
        source: "Lelli et al. 2024, doi:10.1109/ICEM60801.2024.10700403",
    },
];

/// Ratio of L_q to L_d from which a motor is taken to have its magnets inside; with surface magnets it lies nearer to 1.
pub const MAGNETS_INSIDE_FROM: f64 = 1.3;

/// Returns the share by which L_d falls at rated current along +d if the motor's saliency is that of its iron alone, as with magnets on the
/// surface of a round rotor: an estimate from the inductances of a data sheet, no measurement. None without a magnet, and if L_q is not larger
/// than L_d.
///
/// Magnets have nearly the permeability of air, so the air gap is the same all around, and only iron makes a difference. With the law that this
/// program takes of iron (a sixth power of its flux φ, in units of the magnet's), alike in each direction, the energy is φ²/2 + a φ⁸/56. Its
/// curvature along the magnet's flux is 1 + a and across it 1 + a/7, so L_q / L_d = (1 + a) / (1 + a/7) tells the iron's share a. At the flux φ to
/// which a current raises it the curvature is 1 + a φ⁶. Leakage, which no iron limits, makes the true fall of the rest larger, slots make a part of the
/// saliency.
///
/// ```
/// use standstill_plant::{built_in, fall_of_surface_magnets};
///
/// // L_q is 8 % above L_d, and rated current makes a fifth of the magnet's flux.
/// let fall = fall_of_surface_magnets(&built_in("hub-hoverboard").ok_or("not built in")?).ok_or("no saliency")?;
/// assert!((0.13..0.16).contains(&fall));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fall_of_surface_magnets(motor: &Motor) -> Option<f64> {
    let [l_d, l_q] = [motor.winding.d_axis_inductance(), motor.winding.q_axis_inductance()];
    // Of this law L_q is less than seven times L_d.
    if motor.magnet_flux <= 0.0 || l_q <= l_d || l_q >= 7.0 * l_d {
        return None;
    }
    let iron = (l_q / l_d - 1.0) / (1.0 - l_q / (7.0 * l_d));
    let raised = l_d * motor.rated_current / motor.magnet_flux * (1.0 + iron);
    // The current in that unit grows with the flux, at least as fast as this.
    let current = |flux: f64| flux - 1.0 + iron * (power(flux, 7) - 1.0) / 7.0;
    let flux = root(1.0, 1.0 + raised, |flux| Some(current(flux) - raised))?;
    Some(1.0 - (1.0 + iron) / (1.0 + iron * power(flux, 6)))
}

#[cfg(test)]
mod tests {
    use standstill_interface::Dq;
    use standstill_numeric::Heading;

    use super::*;
    use crate::{DataSheet, built_in};

    /// The same from the energy itself: a plane of fluxes, its slopes and curvatures by differences, none of the closed forms.
    #[test]
    fn analytic_the_saliency_of_iron_alike_in_each_direction_tells_its_saturation() {
        for (ratio, current) in [(1.04, 20.0), (1.08, 20.0), (1.08, 5.0), (1.25, 40.0)] {
            let sheet = format!(
                "[nameplate]\npole_pairs = 7\nresistance = 0.1\nL_d = 1e-3\nL_q = {}\nmagnet_flux = 0.1\nrated_current = {current}\ndc_link = 48\n",
                1e-3 * ratio
            );
            let motor = DataSheet::parse("own", &sheet).and_then(|sheet| sheet.motor()).expect("a motor");
            let found = fall_of_surface_magnets(&motor).expect("a saliency");
            let energy = |iron: f64, d: f64, q: f64| {
                let square = d * d + q * q;
                0.5 * square + iron * power(square, 4) / 56.0
            };
            let step = 1e-3;
            let along = |iron: f64, d: f64| {
                (energy(iron, d + step, 0.0) - 2.0 * energy(iron, d, 0.0) + energy(iron, d - step, 0.0))
                    / (step * step)
            };
            let across = |iron: f64| {
                (energy(iron, 1.0, step) - 2.0 * energy(iron, 1.0, 0.0) + energy(iron, 1.0, -step))
                    / (step * step)
            };
            let slope = |iron: f64, d: f64| {
                (energy(iron, d + step, 0.0) - energy(iron, d - step, 0.0)) / (2.0 * step)
            };
            // By steps, upwards: the iron that makes this saliency, then the flux that this current makes.
            let first = |holds: &dyn Fn(f64) -> bool| {
                (0..1_000_000).map(|k| 1e-5 * f64::from(k)).find(|x| holds(*x)).expect("one")
            };
            let iron = first(&|iron| along(iron, 1.0) >= ratio * across(iron));
            let needed = 1e-3 * current / 0.1 * along(iron, 1.0);
            let flux = 1.0 + first(&|more| slope(iron, 1.0 + more) - slope(iron, 1.0) >= needed);
            let fall = 1.0 - along(iron, 1.0) / along(iron, flux);
            assert!((found - fall).abs() < 2e-3, "{ratio} {current}: {found}, not {fall}");
        }
    }

    #[test]
    fn law_without_saliency_iron_says_nothing_and_a_fall_grows_with_the_current() {
        let with = |l_q: f64, current: f64| {
            let sheet = format!(
                "[nameplate]\npole_pairs = 7\nresistance = 0.1\nL_d = 1e-3\nL_q = {l_q}\nmagnet_flux = 0.1\nrated_current = {current}\ndc_link = 48\n"
            );
            let motor = DataSheet::parse("own", &sheet).and_then(|sheet| sheet.motor()).expect("a motor");
            fall_of_surface_magnets(&motor)
        };
        assert_eq!(with(1e-3, 10.0), None);
        assert_eq!(with(0.9e-3, 10.0), None);
        let falls: Vec<f64> =
            [1.0, 5.0, 10.0, 20.0].map(|current| with(1.08e-3, current).expect("a fall")).to_vec();
        assert!(falls.windows(2).all(|pair| pair[0] < pair[1]) && falls[0] > 0.0, "{falls:?}");
    }

    #[test]
    fn law_published_saturation_of_built_in_motors_is_that_of_their_cores() {
        for (name, published) in
            [("paper-5k5", &PUBLISHED_SATURATION[0]), ("pm-reluctance", &PUBLISHED_SATURATION[3])]
        {
            let motor = built_in(name).expect("built in");
            let l_d = |i: f64| {
                let flux = motor.magnetics.flux_at(Dq::new(i, 0.0), Heading::ZERO).expect("within the core");
                motor.magnetics.state(flux, Heading::ZERO).inverse_inductance.inverse()
            };
            for fall in published.falls {
                assert!((fall.current - motor.rated_current).abs() < 0.5, "{name}: {}", motor.rated_current);
                for (sign, stated) in [(1.0, fall.along), (-1.0, fall.against)] {
                    let found = 1.0 - l_d(sign * motor.rated_current).xx / l_d(0.0).xx;
                    assert!((found - stated).abs() < 0.006, "{name}: {found}, not {stated}");
                }
            }
            assert!(l_d(0.0).yy / l_d(0.0).xx > MAGNETS_INSIDE_FROM, "{name}: {:?}", l_d(0.0));
        }
    }
}
