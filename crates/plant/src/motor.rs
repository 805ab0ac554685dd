//! A motor: everything that the simulation needs, validated.

use standstill_interface::{AlphaBeta, Dq};

use crate::{Core, Heading, Linear, MagneticCircuit, Rotor, Thermal, Winding};

/// A permanent-magnet synchronous motor. SI units. Made by [`crate::DataSheet::motor`], which checks that the
/// numbers make a motor; whoever changes a field afterwards keeps that promise themselves.
#[derive(Clone, Debug, PartialEq)]
pub struct Motor {
    /// Its name.
    pub name: String,
    /// p, the number of pole pairs.
    pub pole_pairs: u32,
    /// R in Ω, one phase.
    pub resistance: f64,
    /// Rated current in A, peak of the phase current.
    pub rated_current: f64,
    /// DC-link voltage in V that it is meant for, if its data sheet says so.
    pub dc_link: Option<f64>,
    /// The winding without saturation.
    pub winding: Winding,
    /// ψ_pm in Wb, the open-circuit flux linkage. Exactly zero: there is no magnet.
    pub magnet_flux: f64,
    /// The magnetics that are simulated.
    pub magnetics: MagneticCircuit,
    /// What temperature does to it.
    pub thermal: Thermal,
    /// The mechanical side.
    pub rotor: Rotor,
}

impl Motor {
    /// The same motor with a core that does not saturate and has neither harmonics nor eddy currents: the winding of
    /// equations (1) and (2) alone.
    #[must_use]
    pub fn linearised(&self) -> Self {
        let core = Core::Linear(Linear::from_winding(&self.winding, self.magnet_flux));
        let magnetics = MagneticCircuit::new(core).unwrap_or_else(|_| self.magnetics.clone());
        Self { magnetics, ..self.clone() }
    }

    /// Whether there is a magnet, and with it a north pole. Of a formula its data sheet says so, of a map
    /// [`crate::FluxMap::has_magnet`].
    pub fn has_magnet(&self) -> bool {
        self.magnet_flux != 0.0
    }

    /// Electromagnetic torque in N·m: `3/2 p (ψ × i − ∂W/∂θ)`, with the current i in A into the terminals and the
    /// slope ∂W/∂θ of [`MagneticCircuit::state`]. Cogging is another energy and comes on top.
    pub fn torque(&self, flux: Dq<f64>, current: Dq<f64>, energy_slope: f64) -> f64 {
        1.5 * f64::from(self.pole_pairs) * (flux.d * current.q - flux.q * current.d - energy_slope)
    }

    /// Torque in N·m from slots, without current, at electrical angle θ in rad.
    pub fn cogging(&self, angle: f64) -> f64 {
        self.rotor.cogging.map_or(0.0, |cogging| cogging.at(angle))
    }

    /// Energy in J of the field at a flux in Wb in the rotor's plane, which eddy currents lag behind by `lag` in Wb.
    pub fn field_energy(&self, flux: Dq<f64>, lag: Dq<f64>, angle: f64) -> f64 {
        let eddy = self.magnetics.eddy(lag).map_or(0.0, |eddy| eddy.current.dot(lag) / 2.0);
        let cogging = self.rotor.cogging.map_or(0.0, |cogging| cogging.energy(angle, self.pole_pairs));
        1.5 * (self.magnetics.energy(flux, Heading::of(angle)) + eddy) + cogging
    }

    /// Flux in Wb with no current, at electrical angle θ in rad.
    pub fn open_circuit_flux(&self, angle: f64) -> AlphaBeta<f64> {
        let at = Heading::of(angle);
        self.magnetics.rest(at).unpark_by(at.sin, at.cos)
    }

    /// The electrical angle in rad at which a free rotor stands that came to rest near `angle`: there, if friction
    /// holds it against cogging and load (in N·m); else where it slides to. None if nothing holds it within a
    /// period of the cogging, as when a load overhauls it.
    pub fn standing_angle(&self, angle: f64, load_torque: f64) -> Option<f64> {
        let net = |angle: f64| self.cogging(angle) - load_torque;
        let holds = |angle: f64| net(angle).abs() <= self.rotor.friction.stiction;
        if holds(angle) {
            return Some(angle);
        }
        let direction = net(angle).signum();
        let period = std::f64::consts::TAU / f64::from(self.rotor.cogging?.periods);
        // Downhill in small steps until friction holds or the hill turns; then halve to the edge.
        let step = direction * period / 720.0;
        let beyond = (1..=720)
            .map(|n| angle + step * f64::from(n))
            .find(|angle| holds(*angle) || net(*angle) * direction < 0.0)?;
        let (mut moving, mut resting) = (beyond - step, beyond);
        for _ in 0..60 {
            let middle = (moving + resting) / 2.0;
            if holds(middle) || net(middle) * direction < 0.0 { resting = middle } else { moving = middle }
        }
        Some(resting)
    }
}
