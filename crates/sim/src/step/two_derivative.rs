//! The step: a method of order four with two derivatives and one evaluation of the core.
//!
//! The voltage between two instants is known and is integrated exactly. Only the drop R i needs a quadrature,
//! `∫i ≈ h/2 (i₀ + i₁) + h²/12 (i₀′ − i₁′)`, whose slopes `i′ = Γ ψ′ + …` cost nothing beside the currents. The flux at the
//! end is first predicted; there the core is evaluated; and what the quadrature then misses is put right by one linear
//! step with Γ, which also takes the current of a blocked leg to zero. Angle, speed and the link's voltage are carried by
//! the same rule.
//!
//! The error is estimated from what the currents' values and slopes at both ends say of their third derivative.

use standstill_interface::Dq;
use standstill_numeric::{Heading, Symmetric, Wide};

use crate::physics::bounds::{Bounds, Margins};
use crate::physics::legs::Conducting;
use crate::physics::links::hermite_area;
use crate::physics::machine::{Change, Machine, Operating};
use crate::physics::memory::{Away, Iron, Moved};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::corrections::{Ends, RotorFlux, lag_behind, link_slopes, settle_by, turned_by};
use crate::step::error::{
    Accuracy, SHARE_OF_ANGLE, SHARE_OF_LINK, SHARE_OF_SPEED, error, relaxing_error, ringing_error,
};
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
        let zero = V::of(0.0);
        let h = (until - here.time) * 1e-9;
        let (half, twelfth) = (h * 0.5, h * h * (1.0 / 12.0));
        let terminals = &legs.terminals;
        let begin = &here.state;
        let change = machine.change::<RARE>(legs, &here.at, begin);
        let source = machine.links.source(until * 1e-9);

        // What is predicted: angle and speed, the link's voltage, the currents' integral.
        let (mut turned, mut speed) = (begin.turned, begin.speed);
        let (mut acceleration, mut jerk, mut torque_rise) = ([zero; 2], [zero; 2], [zero; 2]);
        if let Some(rotors) = &machine.rotors {
            acceleration[0] = rotors.acceleration(here.at.torque, begin.speed);
            let iron = some!(machine.memory_if::<RARE>(), memory => memory.iron_here(begin.flux));
            torque_rise[0] = rotors.torque_rise(begin, &here.at, &change, iron.as_ref());
            jerk[0] = rotors.jerk(torque_rise[0], acceleration[0]);
            speed = begin.speed + h * (acceleration[0] + half * jerk[0]);
            turned = begin.turned
                + h * (begin.speed * rotors.moving + half * (acceleration[0] + h * jerk[0] * (1.0 / 3.0)));
        }
        let mut link = source.voltage;
        let (mut link_rise, mut link_bend) = ([here.source.rise, source.rise], [zero; 2]);
        if machine.links.storage.is_some() {
            (link_rise[0], link_bend[0]) = link_slopes(
                machine,
                &terminals.rail,
                begin.link,
                here.source,
                here.at.current,
                change.current,
            );
            link = begin.link + h * (link_rise[0] + half * link_bend[0]);
        }
        let area = if machine.links.storage.is_some() {
            hermite_area(h, [begin.link, link], [link_rise[0], link_rise[0] + h * link_bend[0]])
        } else {
            machine.links.area(h, here.source, source)
        };
        let idle = legs.idle;
        let known = begin.flux + terminals.rail * area + terminals.offset * h;
        let drop = (here.at.current * h + change.current * (h * half)).through(terminals.resistance);
        // What holds the blocked leg's current, as it was at the beginning.
        let holding = terminals.blocked * (change.blocked_potential * (2.0 / 3.0) * h);
        let mut flux = Plane::choose(idle, begin.flux + change.flux * h, known - drop + holding);
        let mut potential = begin.potential;
        let mut start = None;
        if RARE {
            start = Start::of(machine, legs, here, &change, [begin.link, link], link_rise, area, h);
        }
        if RARE && let Some(start) = &start {
            let [moved, mean] = Ringing::ahead(start.modes, h, start.floating, &start.end).after(V::of(1.0));
            flux = begin.flux + moved + terminals.rail * start.surplus[0];
            potential = add(potential, machine.legs.charged(legs, mean * h));
        }
        let mut lagging = begin.lagging;
        let rotor_flux = some!(machine.circuits.eddies(), _ => RotorFlux::of(machine, begin, change.flux * h, begin.speed * h));
        if let (Some(eddies), Some(from)) = (machine.circuits.eddies(), &rotor_flux) {
            let there = State { flux, turned, speed, link, lagging, potential };
            let to =
                RotorFlux { rise: from.rise, ..RotorFlux::of(machine, &there, change.flux * h, speed * h) };
            lagging = lag_behind(h * eddies.rate, begin.lagging, from, &to);
        }

        // What is there.
        let predicted = State { flux, turned, speed, link, lagging, potential };
        let along = change.flux * h;
        let iron =
            some!(machine.memory_if::<RARE>(), memory => memory.iron(&memory.away_at(flux, Some(along))));
        let mut at = machine.operating(&predicted, iron.as_ref());
        let gamma = at.inverse_inductance;
        let across = terminals.blocked.through(gamma);
        let per_impulse = V::of(1.0) / (across.dot(terminals.blocked) + terminals.none_blocked);
        let any_idle = V::any(idle);
        let (looked_up_flux, looked_up_current) = (flux, at.current);
        settle_by(legs, &across, per_impulse, any_idle, &mut flux, &mut at);
        let (predicted_flux, predicted_current) = (flux, at.current);
        // What makes the torque: the stator's iron has no part in it.
        let core = |flux: Plane<V>, current: Plane<V>| {
            [flux, iron.as_ref().map_or(current, |iron| iron.core(current, flux - looked_up_flux))]
        };
        if let Some(rotors) = &machine.rotors {
            let change = [core(looked_up_flux, looked_up_current), core(predicted_flux, predicted_current)];
            at.torque = at.torque + rotors.torque_change(&at, change[0], change[1]);
        }
        let there = State { flux, turned, speed, link, lagging, potential };
        let end_change = machine.change::<RARE>(legs, &at, &there);
        let mut link_error = zero;
        let mut more_area = zero;
        if machine.links.storage.is_some() {
            let storage = machine.links.storage.as_ref().map_or(zero, |storage| storage.rate);
            (link_rise[1], link_bend[1]) =
                link_slopes(machine, &terminals.rail, link, source, at.current, end_change.current);
            let missing = begin.link + hermite_area(h, link_rise, link_bend) - link;
            let x = h * storage;
            let correction = missing / (x * 0.5 + x * x * (1.0 / 12.0) + 1.0);
            link = link + correction;
            link_rise[1] = link_rise[1] - correction * storage;
            link_error = correction;
            more_area = hermite_area(h, [begin.link, link], link_rise) - area;
        }
        let mut angle_error = zero;
        if let Some(rotors) = &machine.rotors {
            let there = State { flux, turned, speed, link, lagging, potential };
            acceleration[1] = rotors.acceleration(at.torque, speed);
            let iron = some!(iron, iron => Iron {
                current: iron.current + (flux - looked_up_flux).through(iron.tangent),
                ..iron
            });
            torque_rise[1] = rotors.torque_rise(&there, &at, &end_change, iron.as_ref());
            jerk[1] = rotors.jerk(torque_rise[1], acceleration[1]);
            let new_speed = begin.speed + hermite_area(h, acceleration, jerk);
            let new_turned = begin.turned
                + hermite_area(h, [begin.speed * rotors.moving, new_speed * rotors.moving], acceleration);
            angle_error = new_turned - turned;
            let speed_error = new_speed - speed;
            (turned, speed) = (new_turned, new_speed);
            at.current = at.current + at.turning * angle_error;
            // The speed acts on the flux through the holding voltage only; what it is off by within a step shows there.
            angle_error = angle_error.abs() + (speed_error * h).abs() * SHARE_OF_SPEED;
        }

        let mut relaxed = zero;
        // What the quadrature misses, and what follows from putting it right.
        let drop = (here.at.current + at.current) * half + (change.current - end_change.current) * twelfth;
        let mut missing =
            known + terminals.rail * more_area - drop.through(terminals.resistance) - predicted_flux;
        if any_idle {
            let through = begin.flux + (change.flux + end_change.flux) * half - predicted_flux;
            missing = Plane::choose(idle, through, missing);
        }
        let (mut ringing, mut resistance) = (None, terminals.resistance);
        if RARE && let Some(start) = &start {
            let surplus = terminals.rail * start.surplus[1];
            let end = End {
                force: terminals.rail * link + terminals.offset - at.current.through(terminals.resistance),
                force_rise: terminals.rail * link_rise[1] - end_change.current.through(terminals.resistance),
                current: at.current,
                current_rise: end_change.current,
                flux_rise: end_change.flux,
                flux: predicted_flux - begin.flux - surplus,
            };
            // The mean of both ends: what turns faster and slower by turns is then right to the next order.
            let [from, to] = [here.at.inverse_inductance, gamma];
            let mean =
                Symmetric::new((from.xx + to.xx) * 0.5, (from.xy + to.xy) * 0.5, (from.yy + to.yy) * 0.5);
            let modes = Modes::of(mean, machine.legs.charging(legs), &terminals.resistance);
            let step = Ringing::between(modes, h, start.floating, [&start.end, &end]);
            let [moved, mean] = step.at_end();
            missing = begin.flux + moved + surplus - predicted_flux;
            potential = add(begin.potential, machine.legs.charged(legs, mean * h));
            resistance = step.left_to_cubics(&terminals.resistance, h);
            ringing = Some(step);
        }
        // Twice without what a blocked leg's terminal would take, the second time with what the correction does to the drop.
        missing = missing - terminals.blocked * (across.dot(missing) * per_impulse);
        let feedback = missing.through(gamma).through(resistance) * half;
        let corrected = missing - feedback;
        let corrected = corrected - terminals.blocked * (across.dot(corrected) * per_impulse);
        missing = Plane::choose(idle, missing, corrected);
        flux = flux + missing;
        at.current = at.current + missing.through(gamma);
        if let (Some(eddies), Some(from)) = (machine.circuits.eddies(), &rotor_flux) {
            let there = State { flux, turned, speed, link, lagging, potential };
            let to = RotorFlux::of(machine, &there, end_change.flux * h, speed * h);
            let new = lag_behind(h * eddies.rate, begin.lagging, from, &to);
            let x = h * eddies.rate;
            let most =
                here.at.lag.d.abs().greatest(at.lag.d.abs()) + here.at.lag.q.abs().greatest(at.lag.q.abs());
            relaxed = relaxing_error(most, x);
            let (g, more) = (eddies.inverse_inductance, new - lagging);
            let more = Dq::new(more.d * g.d, more.q * g.q);
            let turned = if machine.rotors.is_some() {
                Heading::of(turned)
            } else {
                Heading { sin: zero, cos: V::of(1.0) }
            };
            at.current = at.current - Plane::from_rotor(more, turned);
            at.lag = to.flux - new;
            lagging = new;
        }
        settle_by(legs, &across, per_impulse, any_idle, &mut flux, &mut at);
        if let Some(rotors) = &machine.rotors {
            // The torque of what was put right, and the motion that follows from it.
            let change = [core(predicted_flux, predicted_current), core(flux, at.current)];
            at.torque = at.torque + rotors.torque_change(&at, change[0], change[1]);
            acceleration[1] = rotors.acceleration(at.torque, speed);
            speed = begin.speed + hermite_area(h, acceleration, jerk);
            let speeds = [begin.speed * rotors.moving, speed * rotors.moving];
            let new_turned = begin.turned + hermite_area(h, speeds, acceleration);
            at.current = at.current + at.turning * (new_turned - turned);
            turned = new_turned;
            settle_by(legs, &across, per_impulse, any_idle, &mut flux, &mut at);
        }
        if RARE && ringing.is_some() {
            potential = machine.legs.potentials(legs, potential, link, at.current);
        }
        let mut away = None;
        if let (Some(memory), Some(iron)) = (machine.memory_if::<RARE>(), &iron) {
            at.current = at.current + turned_by(memory, iron, flux, looked_up_flux, along);
            settle_by(legs, &across, per_impulse, any_idle, &mut flux, &mut at);
            away = Some((memory.away_at(flux, Some(along)), iron.tangent));
        }
        let state = State { flux, turned, speed, link, lagging, potential };
        let end = Here { time: until, state, at, source };
        // The current at the end is that of where the core was evaluated and a linear step from there.
        let off = flux - looked_up_flux;
        let mut own = error(accuracy, h, &terminals.resistance, here, &end, [&change, &end_change], off);
        if RARE && let Some(ringing) = &ringing {
            own = ringing_error(accuracy, ringing, off);
        }
        let mut error = own
            + angle_error * SHARE_OF_ANGLE * accuracy.per_angle
            + relaxed * accuracy.per_flux
            + link_error.abs() * SHARE_OF_LINK * accuracy.per_flux;
        if let Some(memory) = machine.memory_if::<RARE>() {
            let rise = [along, end_change.flux * h];
            error = error + memory.error(flux - begin.flux, rise, off) * accuracy.per_flux;
        }
        let ends = Ends { change: [change, end_change], link_rise, acceleration, torque_rise };
        Self::between::<RARE>(machine, bounds, legs, here, end, h, ends, ringing, away, error)
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
