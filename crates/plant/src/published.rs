//! Saturation of the d-axis as published, for motors whose data sheets state none.
//!
//! Two data sheets of this repository state the saturation by their sources. Two flux maps are public. From that of
//! Toyota's Prius, the column `Lmidd` at i_q = 0 is used unchanged. From that of a finite-element example, fluxes along
//! d at i_q = 0 are averaged over the rotor's angle and differenced over 60 A. No data were found for motors with
//! surface magnets.

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

#[cfg(test)]
mod tests {
    use standstill_interface::Dq;
    use standstill_numeric::Heading;

    use super::*;
    use crate::built_in;

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
