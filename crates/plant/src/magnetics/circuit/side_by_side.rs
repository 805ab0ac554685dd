//! The magnetic circuits of several motors in parallel lanes, with separate parameters per motor.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Symmetric, Wide};

use super::{Core, MagneticCircuit, MagneticState};
use crate::Linear;
use crate::magnetics::harmonics::Distortion;
use crate::magnetics::{Algebraic, IronBridge, Magnetics};

/// The magnetic circuits of several motors of one kind: the same kind of core with the same exponents, harmonics, eddy
/// currents and hysteresis in all of them or in none.
#[derive(Clone, Debug)]
pub struct Circuits<V: Wide> {
    /// A formula whose coefficients are the motors' own; none: each core is looked up by itself.
    formula: Option<Algebraic<V>>,
    /// Change of the magnet with temperature, as a current in A.
    magnet: Dq<V>,
    distortion: Option<Distortion<V>>,
    eddy: Option<Eddies<V>>,
    /// Whether their iron remembers.
    remember: bool,
}

/// Eddy branches side by side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Eddies<V: Wide> {
    /// 1/τ in 1/s.
    pub rate: V,
    /// G in 1/H.
    pub inverse_inductance: Dq<V>,
}

/// Returns a core as an algebraic one; a linear core is an algebraic one without saturation. None for other cores.
fn formula(core: &Core) -> Option<Algebraic> {
    match core {
        Core::Algebraic(core) => Some(*core),
        Core::Linear(Linear { d_axis_inductance, q_axis_inductance, magnet_flux }) => Some(Algebraic {
            d: 1.0 / d_axis_inductance,
            q: 1.0 / q_axis_inductance,
            magnet_current: magnet_flux / d_axis_inductance,
            ..Algebraic::default()
        }),
        Core::Map(_) | Core::Series(_) => None,
    }
}

#[inline(always)]
fn zero<V: Wide>() -> V {
    V::of(0.0)
}

fn put<V: Wide>(to: &mut V, lane: usize, from: f64) {
    to.put(lane, from);
}

fn put_dq<V: Wide>(to: &mut Dq<V>, lane: usize, from: Dq<f64>) {
    put(&mut to.d, lane, from.d);
    put(&mut to.q, lane, from.q);
}

fn put_symmetric<V: Wide>(to: &mut Symmetric<V>, lane: usize, from: Symmetric) {
    put(&mut to.xx, lane, from.xx);
    put(&mut to.xy, lane, from.xy);
    put(&mut to.yy, lane, from.yy);
}

impl<V: Wide> Circuits<V> {
    /// Makes lanes for circuits of the same kind as this one, and puts this one into all lanes.
    pub fn like(circuit: &MagneticCircuit) -> Self {
        let none = Dq::new(zero(), zero());
        let mut circuits = Self {
            formula: formula(&circuit.core).map(|core| Algebraic {
                d_exponent: core.d_exponent,
                q_exponent: core.q_exponent,
                cross_d_exponent: core.cross_d_exponent,
                cross_q_exponent: core.cross_q_exponent,
                bridge: core
                    .bridge
                    .map(|bridge| IronBridge { exponent: bridge.exponent, ..IronBridge::default() }),
                ..Algebraic::default()
            }),
            magnet: none,
            distortion: circuit.distortion.map(|_| Distortion::default()),
            eddy: circuit.eddy.map(|_| Eddies::default()),
            remember: circuit.hysteresis.is_some(),
        };
        for lane in 0..V::LANES {
            circuits.put(lane, circuit);
        }
        circuits
    }

    /// Returns whether a circuit is of this kind.
    pub fn fits(&self, circuit: &MagneticCircuit) -> bool {
        let same_formula = match (&self.formula, formula(&circuit.core)) {
            (None, _) => true,
            (Some(these), Some(core)) => these.exponents() == core.exponents(),
            (Some(_), None) => false,
        };
        same_formula
            && self.distortion.is_some() == circuit.distortion.is_some()
            && self.eddy.is_some() == circuit.eddy.is_some()
            && self.remember == circuit.hysteresis.is_some()
    }

    /// Puts a circuit of this kind into a lane.
    ///
    /// # Panics
    /// If the circuit does not [fit](Self::fits).
    pub fn put(&mut self, lane: usize, circuit: &MagneticCircuit) {
        assert!(self.fits(circuit), "a circuit of another kind");
        if let (Some(to), Some(from)) = (&mut self.formula, formula(&circuit.core)) {
            put(&mut to.d, lane, from.d);
            put(&mut to.dd, lane, from.dd);
            put(&mut to.q, lane, from.q);
            put(&mut to.qq, lane, from.qq);
            put(&mut to.cross, lane, from.cross);
            put(&mut to.magnet_current, lane, from.magnet_current);
            if let (Some(to), Some(from)) = (&mut to.bridge, from.bridge) {
                put(&mut to.strength, lane, from.strength);
                put(&mut to.saturation, lane, from.saturation);
                put(&mut to.q_share, lane, from.q_share);
                put(&mut to.magnet_flux, lane, from.magnet_flux);
            }
        }
        put_dq(&mut self.magnet, lane, circuit.magnet);
        if let (Some(to), Some(from)) = (&mut self.distortion, &circuit.distortion) {
            to.put(lane, from);
        }
        if let (Some(to), Some((branch, g))) = (&mut self.eddy, circuit.eddy) {
            put(&mut to.rate, lane, 1.0 / branch.time_constant);
            put_dq(&mut to.inverse_inductance, lane, g);
        }
    }

    /// Returns the eddy branches, if there are any.
    pub const fn eddies(&self) -> Option<&Eddies<V>> {
        self.eddy.as_ref()
    }

    /// Returns the current, the inductance and their slopes at fluxes in Wb. `cores`: circuits of the motors, which are
    /// evaluated one by one if the cores are not formulas.
    #[inline(always)]
    pub fn state(&self, flux: Dq<V>, at: Heading<V>, cores: &[&MagneticCircuit]) -> MagneticState<V> {
        if let Some(distortion) = &self.distortion {
            let inside = distortion.inwards(flux, at);
            let (current, hessian) = self.core(inside.core_flux, cores);
            return inside.outwards(current, hessian, self.magnet);
        }
        let (current, hessian) = self.core(flux, cores);
        MagneticState::undistorted(flux, current, hessian, self.magnet)
    }

    #[inline(always)]
    fn core(&self, flux: Dq<V>, cores: &[&MagneticCircuit]) -> (Dq<V>, Symmetric<V>) {
        match &self.formula {
            Some(formula) => formula.evaluate(flux),
            None => look_up(&flux, cores),
        }
    }

    /// Returns whether the cores are known for some currents only.
    pub const fn have_ends(&self) -> bool {
        self.formula.is_none()
    }

    /// Returns the distance in A of the cores' currents from the ends of the ranges of their maps; infinite for
    /// formulas.
    #[inline(always)]
    pub fn room(&self, current: Dq<V>, cores: &[&MagneticCircuit]) -> V {
        if self.formula.is_some() { V::of(f64::INFINITY) } else { look_up_room(&current, cores) }
    }
}

// Not inlined: where numbers that were computed one by one meet those of wide registers, a compiler would take the
// latter apart.
#[inline(never)]
fn look_up<V: Wide>(flux: &Dq<V>, circuits: &[&MagneticCircuit]) -> (Dq<V>, Symmetric<V>) {
    let (mut current, mut gamma) = (Dq::new(zero(), zero()), Symmetric::new(zero(), zero(), zero()));
    for (lane, circuit) in circuits.iter().take(V::LANES).enumerate() {
        let at = Dq::new(flux.d.get(lane), flux.q.get(lane));
        let (i, inverse_inductance) = circuit.core.current_and_inverse_inductance(at);
        put_dq(&mut current, lane, i);
        put_symmetric(&mut gamma, lane, inverse_inductance);
    }
    (current, gamma)
}

#[inline(never)]
fn look_up_room<V: Wide>(current: &Dq<V>, circuits: &[&MagneticCircuit]) -> V {
    let mut room = zero();
    for (lane, circuit) in circuits.iter().take(V::LANES).enumerate() {
        put(&mut room, lane, circuit.core.margin(Dq::new(current.d.get(lane), current.q.get(lane))));
    }
    room
}

impl<V: Wide> Distortion<V> {
    fn put(&mut self, lane: usize, from: &Distortion) {
        let (to, of) = (&mut self.harmonics, &from.harmonics);
        put(&mut to.inductance_4, lane, of.inductance_4);
        put(&mut to.asymmetry, lane, of.asymmetry);
        put(&mut to.flux_5, lane, of.flux_5);
        put(&mut to.flux_7, lane, of.flux_7);
        put_dq(&mut self.rest, lane, from.rest);
        put_symmetric(&mut self.inductance, lane, from.inductance);
        put(&mut self.factor.xx, lane, from.factor.xx);
        put(&mut self.factor.yx, lane, from.factor.yx);
        put(&mut self.factor.yy, lane, from.factor.yy);
    }
}
