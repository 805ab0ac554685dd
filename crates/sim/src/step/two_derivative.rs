//! The step: a method of order four with two derivatives and one evaluation of the core.
//!
//! The voltage between two instants is known and is integrated exactly. Only the drop R i needs a quadrature,
//! `∫i ≈ h/2 (i₀ + i₁) + h²/12 (i₀′ − i₁′)`, whose slopes `i′ = Γ ψ′ + …` cost nothing beside the currents. The flux at the
//! end is first predicted; there the core is evaluated; and what the quadrature then misses is put right by one linear
//! step with Γ, which also takes the current of a blocked leg to zero. Angle, speed and the link's voltage are carried by
//! the same rule.
//!
//! The error is estimated from what the currents' values and slopes at both ends say of their third derivative.

use standstill_numeric::{Symmetric, Wide};

use crate::effect::{Begin, Effect, Looked};
use crate::physics::bounds::{Bounds, Margins};
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine, Operating};
use crate::physics::memory::{Away, Moved};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::corrections::{Ends, turned_by};
use crate::step::error::{Accuracy, error, ringing_error};
use crate::step::floating::Floating;
use crate::step::modes::Modes;
use crate::step::ringing::{End, Ringing, Start};
use standstill_inverter::Source;

/// Machines at a time: their states and what follows from them.
#[derive(Clone, Copy, Debug)]
pub struct Here<V: Wide> {
    /// In ns since the start of the run.
    pub time: V,
    /// The states.
    pub state: State<V>,
    /// What follows.
    pub at: Operating<V>,
    /// The DC sources.
    pub source: Source<V>,
}

/// A step that was tried.
#[derive(Clone, Copy, Debug)]
pub struct Tried<V: Wide> {
    /// Its length in s.
    pub h: V,
    /// What the legs are meanwhile.
    pub legs: Conducting<V>,
    /// Where it ends.
    pub end: Here<V>,
    /// How the machines change at its beginning and at its end.
    pub change: [Change<V>; 2],
    /// How fast the links' voltages rise, in V/s, at both ends.
    pub link_rise: [V; 2],
    /// The rotors' accelerations in rad/s² at both ends.
    pub acceleration: [V; 2],
    /// The terminals, where they have a capacitance.
    pub floating: Option<Floating<V>>,
    /// The cells of the iron, where it remembers.
    pub moved: Option<Moved<V>>,
    /// Currents of the phases, or of the devices that feed them, in A at both ends.
    pub phases: [[V; 3]; 2],
    /// Margins at both ends.
    pub margins: [Margins<V>; 2],
    /// How fast the phase currents rise, in A a step, at both ends.
    pub phase_rise: [[V; 3]; 2],
    /// The torque in N·m at both ends, and how fast it rises, in N·m a step.
    pub torque: [V; 2],
    /// See `torque`.
    pub torque_rise: [V; 2],
    /// Its error relative to the tolerance: at most 1 to be accepted; not a number if anything is none.
    pub error: V,
    /// The least margin of blocked legs at its beginning, with their slack: negative where one was out of its bounds before.
    pub blocked_at_begin: V,
    /// The least of all margins in the step and at its end, with their slack: negative where something ends within it.
    pub least_margin: V,
    /// The least margin of blocked legs at its end, with what is near enough where a leg is taken to conduct.
    pub least_at_mode_end: V,
}

#[inline(always)]
fn add<V: Wide>(a: [V; 3], b: [V; 3]) -> [V; 3] {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

impl<V: Wide> Tried<V> {
    /// Tries a step to times in ns; `RARE`: whether terminals may have a capacitance, or the iron a memory.
    #[inline(always)]
    #[allow(
        clippy::too_many_lines,
        reason = "one step, from prediction to correction, in the order of its equations"
    )]
    pub fn new<const RARE: bool>(
        machine: &Machine<V>,
        bounds: &Bounds<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        until: V,
        accuracy: &Accuracy<V>,
    ) -> Self {
        let h = (until - here.time) * 1e-9;
        let (half, twelfth) = (h * 0.5, h * h * (1.0 / 12.0));
        let (terminals, idle) = (&legs.terminals, legs.idle);
        let begin = &here.state;
        let change = machine.change::<RARE>(legs, &here.at, begin);
        let memory = machine.memory_if::<RARE>();
        let from = Begin { h, machine, memory, legs, here, change: &change };
        let (rotors, eddies) = (machine.rotors.as_ref(), machine.circuits.eddies());
        let mut there = Here { time: until, ..*here };

        // What is predicted.
        let mut rotor = rotors.predict(&from, &mut there);
        let mut link = machine.links.predict(&from, &mut there);
        let known = begin.flux + terminals.rail * link.area + terminals.offset * h;
        let drop = (here.at.current * h + change.current * (h * half)).through(terminals.resistance);
        // What holds the blocked leg's current, as it was at the beginning.
        let holding = terminals.blocked * (change.blocked_potential * (2.0 / 3.0) * h);
        there.state.flux = Plane::choose(idle, begin.flux + change.flux * h, known - drop + holding);
        let mut start = None;
        if RARE {
            start = Start::of(&from, &link);
        }
        if RARE && let Some(start) = &start {
            let [moved, mean] = Ringing::ahead(start.modes, h, start.floating, &start.end).after(V::of(1.0));
            there.state.flux = begin.flux + moved + terminals.rail * start.surplus[0];
            there.state.potential = add(begin.potential, machine.legs.charged(legs, mean * h));
        }
        let mut eddy = eddies.predict(&from, &mut there);

        // What is there.
        let along = change.flux * h;
        let iron = some!(memory, memory => memory.iron(&memory.away_at(there.state.flux, Some(along))));
        there.at = machine.operating(&there.state, iron.as_ref());
        let looked = Looked::at(&there, iron, legs);
        looked.settle(legs, &mut there);
        let predicted = [there.state.flux, there.at.current];
        if let Some(rotors) = rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut there);
        }
        let end_change = machine.change::<RARE>(legs, &there.at, &there.state);
        machine.links.correct(&from, &looked, &end_change, &mut there, &mut link);
        rotors.correct(&from, &looked, &end_change, &mut there, &mut rotor);

        // What the quadrature misses, and what follows from putting it right.
        let drop =
            (here.at.current + there.at.current) * half + (change.current - end_change.current) * twelfth;
        let mut missing =
            known + terminals.rail * link.more - drop.through(terminals.resistance) - predicted[0];
        if looked.any_idle {
            let through = begin.flux + (change.flux + end_change.flux) * half - predicted[0];
            missing = Plane::choose(idle, through, missing);
        }
        let (mut ringing, mut resistance) = (None, terminals.resistance);
        if RARE && let Some(start) = &start {
            let surplus = terminals.rail * start.surplus[1];
            let way = predicted[0] - begin.flux - surplus;
            let end = End::of(terminals, &there.at, &end_change, link.end(), way);
            // The mean of both ends: what turns faster and slower by turns is then right to the next order.
            let [from, to] = [here.at.inverse_inductance, looked.gamma];
            let mean =
                Symmetric::new((from.xx + to.xx) * 0.5, (from.xy + to.xy) * 0.5, (from.yy + to.yy) * 0.5);
            let modes = Modes::of(mean, machine.legs.charging(legs), &terminals.resistance);
            let step = Ringing::between(modes, h, start.floating, [&start.end, &end]);
            let [moved, mean] = step.at_end();
            missing = begin.flux + moved + surplus - predicted[0];
            there.state.potential = add(begin.potential, machine.legs.charged(legs, mean * h));
            resistance = step.left_to_cubics(&terminals.resistance, h);
            ringing = Some(step);
        }
        // Twice without what a blocked leg's terminal would take, the second time with what the correction does to the drop.
        missing = looked.held(legs, missing);
        let feedback = missing.through(looked.gamma).through(resistance) * half;
        missing = Plane::choose(idle, missing, looked.held(legs, missing - feedback));
        there.state.flux = there.state.flux + missing;
        there.at.current = there.at.current + missing.through(looked.gamma);
        eddies.correct(&from, &looked, &end_change, &mut there, &mut eddy);
        looked.settle(legs, &mut there);
        if let (Some(rotors), Some(rotor)) = (rotors, &mut rotor) {
            rotors.finish(&from, &looked, predicted, &mut there, rotor);
        }
        if RARE && ringing.is_some() {
            there.state.potential =
                machine.legs.potentials(legs, there.state.potential, there.state.link, there.at.current);
        }
        let mut away = None;
        if let (Some(memory), Some(iron)) = (memory, &looked.iron) {
            let flux = there.state.flux;
            there.at.current = there.at.current + turned_by(memory, iron, flux, looked.flux, along);
            looked.settle(legs, &mut there);
            away = Some((memory.away_at(there.state.flux, Some(along)), iron.tangent));
        }

        // The current at the end is that of where the core was evaluated and a linear step from there.
        let off = there.state.flux - looked.flux;
        let mut own = error(accuracy, h, &terminals.resistance, here, &there, [&change, &end_change], off);
        if RARE && let Some(ringing) = &ringing {
            own = ringing_error(accuracy, ringing, off);
        }
        let mut error = own
            + rotors.error(&rotor, accuracy)
            + eddies.error(&eddy, accuracy)
            + machine.links.error(&link, accuracy);
        if let Some(memory) = memory {
            let rise = [along, end_change.flux * h];
            error = error + memory.error(there.state.flux - begin.flux, rise, off) * accuracy.per_flux;
        }
        let none = [V::of(0.0); 2];
        let (acceleration, torque_rise) = match &rotor {
            Some(rotor) => (rotor.acceleration, rotor.torque_rise),
            None => (none, none),
        };
        let ends = Ends { change: [change, end_change], link_rise: link.rise, acceleration, torque_rise };
        Self::between::<RARE>(machine, bounds, legs, here, there, h, ends, ringing, away, error)
    }

    /// The step of `h` seconds from one place to another, with what ends within it.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "two kinds of steps end here, with all that they found")]
    pub(super) fn between<const RARE: bool>(
        machine: &Machine<V>,
        bounds: &Bounds<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        end: Here<V>,
        h: V,
        ends: Ends<V>,
        ringing: Option<Ringing<V>>,
        away: Option<(Away<V>, Symmetric<V>)>,
        mut error: V,
    ) -> Self {
        let zero = V::of(0.0);
        let [change, end_change] = &ends.change;
        let mut phases = [machine.legs.phases(here.at.current), machine.legs.phases(end.at.current)];
        if let Some(elastance) = machine.legs.elastance_if::<RARE>() {
            // A device carries what its terminal takes to follow the link, too.
            let capacitance = V::of(1.0) / elastance;
            for (phases, rise) in phases.iter_mut().zip(ends.link_rise) {
                for k in 0..3 {
                    phases[k] = phases[k] + legs.leg[k].rail * rise * capacitance;
                }
            }
        }
        let mut floating = None;
        if RARE && let Some(ringing) = ringing {
            let places =
                Floating::new(machine, legs, [here, &end], [change, end_change], &phases, h, ringing);
            error = error.greatest(places.too_long(machine.lags()));
            floating = Some(places);
        }
        let rises = [change.flux * h, end_change.flux * h];
        let (memory, way) = (machine.memory_if::<RARE>(), end.state.flux - here.state.flux);
        let moved = some!(memory.zip(away), (memory, away) => memory.moved(away, way, rises));
        let margins = [
            bounds.margins::<RARE>(machine, legs, &here.state, &here.at, change, &phases[0]),
            bounds.margins::<RARE>(machine, legs, &end.state, &end.at, end_change, &phases[1]),
        ];
        let mut tried = Self {
            h,
            legs: *legs,
            phases,
            margins,
            phase_rise: [
                machine.legs.phases(change.current * h),
                machine.legs.phases(end_change.current * h),
            ],
            torque: [here.at.torque, end.at.torque],
            torque_rise: [ends.torque_rise[0] * h, ends.torque_rise[1] * h],
            end,
            change: ends.change,
            link_rise: ends.link_rise,
            acceleration: ends.acceleration,
            floating,
            moved,
            error,
            blocked_at_begin: zero,
            least_margin: zero,
            least_at_mode_end: zero,
        };
        tried.look_for_ends::<RARE>(machine, bounds);
        tried
    }
}
