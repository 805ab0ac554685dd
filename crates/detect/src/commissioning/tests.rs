use standstill_interface::{Abc, Angle, Arithmetic, Real};

use super::model::{Model, UNKNOWNS};
use super::{Commissioning, CommissioningError, CommissioningSettings, Correction, Learnt};
use crate::parts::complex::{Complex, Turning};
use crate::parts::lines::{Saliency, SaliencySign, reflection};

const SIGN: SaliencySign = SaliencySign::Negative;

/// A motor as `standstill_plant` defines it, in H, phase by phase; and the gains with which its lines are read.
#[derive(Clone, Copy)]
struct Machine {
    mean: f64,
    saliency: f64,
    /// `L_4 cos 4θ` in phase a, `L_4 cos 4(θ − 120°)` in b, and so on.
    fourth: f64,
    /// Excess of phase a's inductance in H.
    asymmetry: f64,
    /// κ in H: by how much a pulse with i_d > 0 lowers the inductance along d.
    saturation: f64,
    gain: [f64; 3],
}

const PAPER: Machine =
    Machine { mean: 9.2e-3, saliency: -2.1e-3, fourth: 0.0, asymmetry: 0.0, saturation: 0.0, gain: [1.0; 3] };

/// Errors of a typical size: a 4θ harmonic of 3 % of L_B, and a phase that is larger by 1 % of L_A.
const WRONG: Machine = Machine { fourth: -0.03 * 2.1e-3, asymmetry: 0.01 * 9.2e-3, ..PAPER };

const EVERYTHING: Machine =
    Machine { fourth: 0.2e-3, saturation: 0.15e-3, gain: [1.006, 0.997, 1.001], ..WRONG };

impl Machine {
    fn lines(&self, angle: f64) -> Abc<f64> {
        let third = core::f64::consts::TAU / 3.0;
        // Self-inductance of a phase, mutual inductance of two: equations (1) and (2), and the same for 4θ, such that
        // equal currents in all phases make no flux in the air gap.
        let l = |x: usize, y: usize| {
            let shift = third * (x + y) as f64;
            let even = if x == y { self.mean } else { -self.mean / 2.0 };
            let odd = if x == 0 && y == 0 { self.asymmetry } else { 0.0 };
            even + self.saliency * (2.0 * angle - shift).cos()
                + self.fourth * (4.0 * angle + shift).cos()
                + odd
        };
        let line = |number: usize| {
            let (x, y) = (number, (number + 1) % 3);
            let direction = third * number as f64 - third / 4.0;
            let saturated = self.saturation * (direction - angle).cos().powi(3);
            self.gain[number] * (l(x, x) + l(y, y) - 2.0 * l(x, y) - saturated)
        };
        Abc::new(line(0), line(1), line(2))
    }

    /// Learns from `count` positions that are spread well but not evenly.
    fn learn<T: Real>(
        &self,
        settings: CommissioningSettings<T>,
        count: u8,
        unit: f64,
        poles: bool,
    ) -> Result<Learnt<T>, CommissioningError<T>> {
        let mut commissioning = Commissioning::new(settings).expect("settings");
        for step in 0..count {
            let angle = 2.4 * f64::from(step);
            let north = poles.then(|| Angle::from_radians(T::of(angle + 0.4)));
            commissioning.add(self.lines(angle).map(|line| T::of(line * unit)), north)?;
        }
        commissioning.learn()
    }

    /// The largest error of the axis in degrees.
    fn worst<T: Real>(&self, correction: &Correction<T>, poles: bool) -> f64 {
        (0..360).fold(0.0_f64, |worst, degree| {
            let angle = f64::from(degree).to_radians();
            let north = poles.then(|| Angle::from_radians(T::of(angle)));
            let found = correction.apply(self.lines(angle).map(T::of), SIGN, north);
            worst.max(axis_error(found.axis.radians().to_double(), angle).abs())
        })
    }
}

/// Returns the difference in degrees, in (−90, 90].
fn axis_error(found: f64, truth: f64) -> f64 {
    Angle::from_radians(2.0 * (found - truth)).difference(Angle::from_radians(0.0)).to_degrees() / 2.0
}

fn usual<T: Real>() -> CommissioningSettings<T> {
    CommissioningSettings::usual(SIGN)
}

/// Uniform random numbers in (0, 1), the same in each run.
struct Chance(u64);

impl Chance {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (core::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Returns the model of a machine, by the formulas of the module.
fn model_of(machine: &Machine) -> Model<f64> {
    Model {
        offset: Complex::new(2.0 / 9.0 * machine.asymmetry, 0.0),
        saliency: machine.saliency,
        fourth: machine.fourth,
        saturation: machine.saturation / 4.0,
    }
}

#[test]
fn analytic_the_model_is_what_phases_make_of_three_lines() {
    for machine in [PAPER, WRONG, Machine { gain: [1.0; 3], ..EVERYTHING }] {
        let model = model_of(&machine);
        for degree in 0..360 {
            let angle = f64::from(degree).to_radians();
            let (z, _) = reflection(machine.lines(angle));
            assert!((z - model.at(angle).z).length() < 1e-14, "{degree}");
            // And back.
            let (found, amplitude) = model.angle(z, Some(Angle::from_radians(angle)));
            assert!(
                Angle::from_radians(found).difference(Angle::from_radians(angle)).abs() < 1e-12,
                "{degree}"
            );
            assert!((amplitude / model.saliency - 1.0).abs() < 1e-10);
        }
    }
}

#[test]
fn analytic_unequal_gains_are_an_offset_and_a_term_that_turns_backwards() {
    let machine = Machine { gain: [1.006, 0.997, 0.997], ..PAPER };
    let third = core::f64::consts::TAU / 3.0;
    let e = (0..3).fold(Complex::zero(), |e, line| {
        e + Complex::turn(third * (1.0 - line as f64)).scale(machine.gain[line] - 1.0)
    });
    for degree in 0..360 {
        let angle = f64::from(degree).to_radians();
        let own = Complex::turn(2.0 * angle).scale(machine.saliency);
        let expected = own - e.scale(2.0 / 3.0 * machine.mean) + (e * own).conj().scale(1.0 / 3.0);
        assert!((reflection(machine.lines(angle)).0 - expected).length() < 1e-14, "{degree}");
    }
}

#[test]
fn analytic_derivatives_are_those_of_the_model() {
    let model = model_of(&EVERYTHING);
    let mut step = [0.0; UNKNOWNS];
    for angle in [0.3, 1.9, 4.4] {
        let reading = model.at(angle);
        let turned = (model.at(angle + 1e-5).z - model.at(angle - 1e-5).z).scale(0.5e5);
        assert!((turned - reading.over_angle).length() < 1e-9 * 4.2e-3);
        let found = model.angle_over_unknowns(angle);
        for unknown in 0..UNKNOWNS {
            step[unknown] = 1e-8;
            let (more, less) = (model.moved(&step), model.moved(&step.map(|s| -s)));
            step[unknown] = 0.0;
            let slope = (more.at(angle).z - less.at(angle).z).scale(0.5e8);
            assert!((slope - reading.over_unknowns[unknown]).length() < 1e-9, "{unknown}");
            let north = Some(Angle::from_radians(angle));
            let turn = (more.angle(reading.z, north).0 - less.angle(reading.z, north).0) * 0.5e8;
            assert!((turn - found[unknown]).abs() < 1e-5 * found[0].hypot(found[1]), "{unknown}");
        }
    }
}

#[test]
fn analytic_the_issues_figures_vanish() {
    // Uncorrected: 3 % / 2 in rad is 0.86° at most, 0.61° rms; 2/9 of 1 % / 2 |L_B| / L_A is 0.28° at most.
    let fourth = Machine { asymmetry: 0.0, ..WRONG };
    let odd = Machine { fourth: 0.0, ..WRONG };
    for (machine, before) in [(fourth, 0.859), (odd, 0.279), (WRONG, 1.13)] {
        let none = machine.worst(&Correction::<f64>::none(), false);
        assert!((none / before - 1.0).abs() < 0.02, "{none}");
        let learnt = machine.learn::<f64>(usual(), 12, 1.0, false).expect("learnt");
        let after = machine.worst(&learnt.correction, false);
        assert!(after < 1e-7, "{after}");
        assert!((learnt.correction.fourth() * learnt.mean - machine.fourth).abs() < 1e-11);
        assert!(learnt.residual < 1e-11 && learnt.deviations.axis < 1e-7);
        assert!((learnt.saliency / machine.saliency - 1.0).abs() < 1e-7);
    }
}

#[test]
fn analytic_saturation_is_learnt_with_the_poles_only() {
    let machine = Machine { gain: [1.0; 3], ..EVERYTHING };
    assert!(machine.worst(&Correction::<f64>::none(), false) > 2.0);
    let learnt = machine.learn::<f64>(usual(), 16, 1.0, true).expect("learnt");
    // The mean L_A, which is the unit, is not quite the same at all angles either.
    let after = machine.worst(&learnt.correction, true);
    assert!(after < 0.01, "{after}");
    let blind = machine.worst(&learnt.correction, false);
    assert!(blind > 0.4, "{blind}");
    let learnt = machine.learn::<f64>(usual(), 16, 1.0, false).expect("learnt");
    assert!(learnt.residual > 1e-5 && learnt.correction.values()[3] == 0.0);
}

#[test]
fn analytic_gains_of_half_a_percent_leave_a_little() {
    let machine = Machine { gain: [1.005, 0.995, 1.0], ..PAPER };
    let learnt = machine.learn::<f64>(usual(), 16, 1.0, false).expect("learnt");
    let (before, after) =
        (machine.worst(&Correction::<f64>::none(), false), machine.worst(&learnt.correction, false));
    assert!(before > 0.7 && after < 0.15, "{before} {after}");
}

#[test]
fn law_noise_does_what_the_stated_deviations_say() {
    for poles in [false, true] {
        let settings = CommissioningSettings { most_dilution: 3.0, ..usual() };
        let mut chance = Chance(7);
        let (mut squares, mut stated, mut residual) = (0.0, 0.0, 0.0);
        let (mut off, mut allowed) = (0.0, 0.0);
        let sets = 300;
        for _ in 0..sets {
            let mut commissioning = Commissioning::new(settings).expect("settings");
            for step in 0..16 {
                let angle = 2.4 * f64::from(step) + chance.uniform();
                let lines = WRONG.lines(angle).map(|line| line + 40e-6 * chance.normal());
                commissioning.add(lines, poles.then(|| Angle::from_radians(angle))).expect("room");
            }
            let learnt = commissioning.learn().expect("learnt");
            stated += learnt.deviations.axis.powi(2);
            residual += learnt.residual.powi(2);
            off += (learnt.correction.fourth() - WRONG.fourth / WRONG.mean).powi(2);
            allowed += learnt.deviations.fourth.powi(2);
            for degree in (0..360).step_by(10) {
                let angle = f64::from(degree).to_radians();
                let north = poles.then(|| Angle::from_radians(angle));
                let found = learnt.correction.apply(WRONG.lines(angle), SIGN, north);
                squares += axis_error(found.axis.radians(), angle).to_radians().powi(2) / 36.0;
            }
        }
        // Each part of Z has √6/9 of a line's noise.
        let noise = (residual / f64::from(sets)).sqrt() / (40e-6 * 6.0_f64.sqrt() / 9.0);
        assert!((noise - 1.0).abs() < 0.03, "{noise}");
        assert!(((off / allowed).sqrt() - 1.0).abs() < 0.1, "{off} {allowed}");
        let ratio = (squares / stated).sqrt();
        assert!((ratio - 1.0).abs() < 0.1, "{poles}: {ratio}");
    }
}

#[test]
fn law_positions_close_together_are_refused_with_a_number() {
    let clustered = |width: f64, noise: f64| {
        let mut chance = Chance(3);
        let mut commissioning = Commissioning::new(usual()).expect("settings");
        for step in 0..16 {
            let lines = WRONG.lines(1.0 + width * f64::from(step) / 16.0);
            commissioning.add(lines.map(|line| line + noise * chance.normal()), None).expect("room");
        }
        commissioning.learn()
    };
    for noise in [0.0, 40e-6] {
        for width in [0.0, 0.01, 0.3, 1.0] {
            let Err(CommissioningError::TooClose { dilution, allowed }) = clustered(width, noise) else {
                panic!("{width} {noise}: {:?}", clustered(width, noise));
            };
            assert!(dilution > allowed && allowed == usual::<f64>().most_dilution);
        }
        // Half a turn of the rotor is a whole turn of Z.
        assert!(clustered(3.1, noise).is_ok());
    }
}

#[test]
fn law_what_is_not_such_a_motor_is_refused() {
    let mut commissioning = Commissioning::<f64>::new(usual()).expect("settings");
    assert_eq!(commissioning.learn(), Err(CommissioningError::TooFew { found: 0, needed: 8 }));
    for bad in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        let lines = Abc::new(27e-3, bad, 30e-3);
        assert_eq!(commissioning.add(lines, None), Err(CommissioningError::NotInductive));
    }
    assert!(commissioning.is_empty());
    for step in 0..32 {
        // The amplitude itself changes: another motor each time.
        let other = Machine { saliency: -2.1e-3 * (1.0 + 0.3 * (7.0 * f64::from(step)).sin()), ..PAPER };
        commissioning.add(other.lines(2.4 * f64::from(step)), None).expect("room");
    }
    assert_eq!(commissioning.add(PAPER.lines(0.0), None), Err(CommissioningError::Full { room: 32 }));
    let Err(CommissioningError::Unexplained { residual, allowed }) = commissioning.learn() else {
        panic!("{:?}", commissioning.learn());
    };
    assert!(residual > 0.15 && allowed == 0.06);
    // No saliency at all, with noise or without.
    let round = Machine { saliency: 0.0, ..PAPER };
    assert!(round.learn::<f64>(usual(), 12, 1.0, false).is_err());
    let mut chance = Chance(1);
    let mut noise = Commissioning::new(usual()).expect("settings");
    for _ in 0..16 {
        noise.add(Abc([0.0; 3]).map(|_: f64| 27e-3 + 40e-6 * chance.normal()), None).expect("room");
    }
    assert!(noise.learn().is_err());
}

#[test]
fn law_settings_that_cannot_work_are_refused() {
    let refused = |settings| Commissioning::<f64>::new(settings).expect_err("must be refused").setting;
    assert_eq!(refused(CommissioningSettings { least_positions: 4, ..usual() }), "least_positions");
    assert_eq!(refused(CommissioningSettings { least_positions: 33, ..usual() }), "least_positions");
    assert_eq!(refused(CommissioningSettings { most_dilution: f64::NAN, ..usual() }), "most_dilution");
    assert_eq!(refused(CommissioningSettings { most_residual: 0.0, ..usual() }), "most_residual");
}

#[test]
fn law_a_correction_survives_its_storage_and_a_lost_one_is_refused() {
    let correction = WRONG.learn::<f64>(usual(), 12, 1.0, false).expect("learnt").correction;
    assert_eq!(Correction::new(correction.values()), Ok(correction));
    assert_eq!(Correction::new([0.0; 4]), Ok(Correction::<f64>::none()));
    for bad in [f64::NAN, f64::INFINITY, -0.6] {
        for place in 0..4 {
            let mut values = correction.values();
            values[place] = bad;
            assert!(Correction::new(values).is_err());
        }
    }
}

#[test]
fn law_no_correction_is_the_papers_equations() {
    for degree in 0..180 {
        let lines = EVERYTHING.lines(f64::from(degree).to_radians());
        let (own, none) = (Saliency::from_lines(lines, SIGN), Correction::none().apply(lines, SIGN, None));
        assert!(axis_error(own.axis.radians(), none.axis.radians()).abs() < 1e-12);
        assert!((own.amplitude / none.amplitude - 1.0).abs() < 1e-12 && own.mean == none.mean);
    }
}

#[test]
fn law_units_and_common_gains_do_not_matter() {
    for poles in [false, true] {
        let own = WRONG.learn::<f64>(usual(), 12, 1.0, poles).expect("learnt");
        for unit in [1e6, 1.1, 1e-6] {
            let other = WRONG.learn::<f64>(usual(), 12, unit, poles).expect("learnt");
            for (a, b) in own.correction.values().into_iter().zip(other.correction.values()) {
                assert!((a - b).abs() < 1e-9);
            }
            assert!((other.saliency / (own.saliency * unit) - 1.0).abs() < 1e-9);
            let single = WRONG.learn::<f32>(usual(), 12, unit, poles).expect("learnt");
            assert!(WRONG.worst(&single.correction, poles) < 0.01);
        }
        let lines = WRONG.lines(1.0);
        let scaled = own.correction.apply(lines.map(|line| 1.3 * line), SIGN, None);
        let axis = own.correction.apply(lines, SIGN, None).axis;
        assert!(scaled.axis.difference(axis).abs() < 1e-12);
    }
}

#[test]
fn regress_single_precision_learns_the_same() {
    for (machine, poles) in [(WRONG, false), (EVERYTHING, true)] {
        let double = machine.learn::<f64>(usual(), 16, 1.0, poles);
        let single = machine.learn::<f32>(usual(), 16, 1.0, poles);
        let (double, single) = (double.expect("learnt").correction, single.expect("learnt").correction);
        for degree in 0..360 {
            let angle = f64::from(degree).to_radians();
            let lines = machine.lines(angle);
            let a = double.apply(lines, SIGN, poles.then(|| Angle::from_radians(angle))).axis.radians();
            let north = poles.then(|| Angle::from_radians(f32::of(angle)));
            let b = single.apply(lines.map(f32::of), SIGN, north).axis.radians();
            assert!(axis_error(a, f64::from(b)).abs() < 0.01, "{degree}");
        }
    }
}
