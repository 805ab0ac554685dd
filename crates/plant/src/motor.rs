//! A motor: everything that the simulation needs, validated.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Lane};

use crate::{Core, FluxMap, Linear, MagneticCircuit, PoleKnowledge, Rotor, Thermal, Winding};

/// A permanent-magnet synchronous motor. SI units; currents and fluxes are peak values of a phase, and their d and q
/// amplitude-invariant. Made by [`crate::DataSheet::motor`], which checks that the
/// numbers make a motor; whoever changes a field afterwards keeps that promise themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Name of the motor.
    pub name: String,
    /// p, the number of pole pairs.
    pub pole_pairs: u32,
    /// R in Ω, one phase.
    pub resistance: f64,
    /// Rated current in A, peak of the phase current.
    pub rated_current: f64,
    /// DC-link voltage in V for which the motor is made; none if its data sheet does not state it.
    pub dc_link: Option<f64>,
    /// The winding without saturation.
    pub winding: Winding,
    /// ψ_pm in Wb, the open-circuit flux linkage. Exactly zero for a motor without a magnet.
    pub magnet_flux: f64,
    /// The magnetics that are simulated.
    pub magnetics: MagneticCircuit,
    /// Coefficients of temperature.
    pub thermal: Thermal,
    /// The mechanical side.
    pub rotor: Rotor,
    /// Ratings by the nameplate.
    pub ratings: Ratings,
}

/// Ratings of a machine in operation. The simulation does not use them; they are compared with the values that follow
/// from the other numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ratings {
    /// Power at the shaft in W.
    pub power: Option<f64>,
    /// Speed of the shaft in revolutions per minute.
    pub speed_rpm: Option<f64>,
    /// Torque at the shaft with rated current, in N m.
    pub torque: Option<f64>,
}

impl Motor {
    /// Returns the motor with a linear core, without harmonics, eddy currents and hysteresis: the winding of
    /// equations (1) and (2) alone.
    ///
    /// ```
    /// use standstill_plant::{PolarityPoint, built_in};
    ///
    /// let motor = built_in("paper-5k5").ok_or("not built in")?;
    /// let poles = |motor: &standstill_plant::Motor| PolarityPoint::of(&motor.magnetics, motor.rated_current);
    /// // Only saturation tells north from south.
    /// assert!(poles(&motor)?.difference().abs() > 0.01);
    /// assert!(poles(&motor.linearised())?.difference().abs() < 1e-9);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn linearised(&self) -> Self {
        let core = Core::Linear(Linear::from_winding(&self.winding, self.magnet_flux));
        let magnetics = MagneticCircuit::new(core).unwrap_or_else(|_| self.magnetics.clone());
        Self { magnetics, ..self.clone() }
    }

    /// Returns true if there is a magnet, and with it a north pole. For a formula its data sheet decides, for a map
    /// [`crate::FluxMap::has_magnet`].
    pub fn has_magnet(&self) -> bool {
        self.magnet_flux != 0.0
    }

    /// Returns whether anything is known of the core's saturation, without which its poles cannot be distinguished. A
    /// core that is stated not to saturate is known.
    pub fn saturation_is_known(&self) -> bool {
        !matches!(self.magnetics.core(), Core::Linear(_))
    }

    /// Returns the knowledge of which pole draws more current. For a map that was continued along d, it contains only
    /// what all fitting cores have in common.
    pub fn pole_knowledge(&self) -> PoleKnowledge {
        if !self.saturation_is_known() {
            return PoleKnowledge::NotGiven;
        }
        self.magnetics.map().map_or(PoleKnowledge::Known, |map| map.pole(self.rated_current))
    }

    /// Returns the caveat for all results of a map that is too coarse; none otherwise.
    pub fn map_note(&self) -> Option<String> {
        self.magnetics.map().and_then(FluxMap::note).map(|note| format!("the motor's map is {note}"))
    }

    /// Returns the electromagnetic torque in N·m: `3/2 p (ψ × i − ∂W/∂θ)`, with the current i in A into the terminals
    /// and the slope ∂W/∂θ of [`MagneticCircuit::state`]. Cogging is another energy and comes on top.
    ///
    /// ```
    /// use standstill_interface::Dq;
    /// use standstill_plant::built_in;
    ///
    /// let motor = built_in("surface-magnet").ok_or("not built in")?.linearised();
    /// // The magnet's flux alone: 3/2 p ψ i_q.
    /// let torque = motor.torque(Dq::new(motor.magnet_flux, 0.0), Dq::new(0.0, 2.0), 0.0);
    /// let expected = 1.5 * f64::from(motor.pole_pairs) * motor.magnet_flux * 2.0;
    /// assert!((torque - expected).abs() < 1e-12 * expected);
    /// # Ok::<(), &str>(())
    /// ```
    #[inline(always)]
    pub fn torque<T: Lane>(&self, flux: Dq<T>, current: Dq<T>, energy_slope: T) -> T {
        (flux.d * current.q - flux.q * current.d - energy_slope) * (1.5 * f64::from(self.pole_pairs))
    }

    /// Returns the torque in N·m from slots, without current, at electrical angle θ in rad.
    #[inline(always)]
    pub fn cogging<T: Lane>(&self, angle: T) -> T {
        if let Some(cogging) = &self.rotor.cogging { cogging.at(angle) } else { T::of(0.0) }
    }

    /// Returns the energy in J of the field at a flux in Wb in the rotor's plane, which eddy currents lag behind by
    /// `lag` in Wb.
    pub fn field_energy(&self, flux: Dq<f64>, lag: Dq<f64>, angle: f64) -> f64 {
        let eddy = self.magnetics.eddy(lag).map_or(0.0, |eddy| eddy.current.dot(lag) / 2.0);
        let cogging = self.rotor.cogging.map_or(0.0, |cogging| cogging.energy(angle, self.pole_pairs));
        1.5 * (self.magnetics.energy(flux, Heading::of(angle)) + eddy) + cogging
    }

    /// Returns the electrical angle in rad at which a free rotor comes to rest after release at `angle`: at `angle`, if
    /// friction holds it against cogging and load (in N·m), otherwise where it rests after sliding and swinging. None
    /// if nothing stops the rotor, as with an overhauling load.
    ///
    /// The kinetic energy is the work of cogging and load less that of sliding friction. The rotor turns back where its
    /// kinetic energy is zero, and stays there if stiction holds it. Viscous friction is neglected.
    pub fn standing_angle(&self, angle: f64, load_torque: f64) -> Option<f64> {
        let stiction = self.rotor.friction.stiction;
        let net = |angle: f64| self.cogging(angle) - load_torque;
        let mut stands = angle;
        for _ in 0..MOST_SWINGS {
            if net(stands).abs() <= stiction {
                return Some(stands);
            }
            stands = self.swing(stands, load_torque)?;
        }
        // Next to no friction: the swings shrink by next to nothing until stiction holds the last one.
        let period = std::f64::consts::TAU / f64::from(self.rotor.cogging?.periods);
        let direction = net(stands).signum();
        let rests = |angle: f64| net(angle).abs() <= stiction || net(angle) * direction < 0.0;
        first(stands, direction * period, rests)
    }

    /// Returns the electrical angle in rad at which the speed of a rotor that starts from rest at this angle is zero
    /// again; none if it never is.
    fn swing(&self, angle: f64, load_torque: f64) -> Option<f64> {
        let cogging = self.rotor.cogging?;
        let direction = (cogging.at(angle) - load_torque).signum();
        let p = f64::from(self.pole_pairs);
        let begin = cogging.energy(angle, self.pole_pairs);
        let against = (direction * load_torque + self.rotor.friction.coulomb) / p;
        let spent = |to: f64| begin - cogging.energy(to, self.pole_pairs) <= against * (to - angle).abs();
        // From one period to the next the same is gained or lost: what is not stopped in the first never is.
        first(angle, direction * std::f64::consts::TAU / f64::from(cogging.periods), spent)
    }
}

/// Largest number of swings that are computed one by one; a rotor that still swings counts as hardly damped.
const MOST_SWINGS: usize = 1000;

/// Returns the first angle, within `way` from `from`, at which a condition holds that does not hold at `from`.
fn first(from: f64, way: f64, holds: impl Fn(f64) -> bool) -> Option<f64> {
    let at = |n: i32| from + way * f64::from(n) / 720.0;
    let n = (1..=720).find(|n| holds(at(*n)))?;
    let (mut before, mut after) = (at(n - 1), at(n));
    for _ in 0..60 {
        let middle = (before + after) / 2.0;
        if holds(middle) { after = middle } else { before = middle }
    }
    Some(after)
}
