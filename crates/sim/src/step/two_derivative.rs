//! The step: a fourth-order two-derivative method with one evaluation of the core per step.
//!
//! The terminal voltage between two instants is known and integrated exactly. Only the resistive drop R i needs a quadrature,
//! `∫i ≈ h/2 (i₀ + i₁) + h²/12 (i₀′ − i₁′)`, whose slopes `i′ = Γ ψ′ + …` need no further evaluation of the core. The
//! flux at the end is predicted, and the core is evaluated there. Then one linear correction with the inverse inductance Γ
//! removes the difference between prediction and quadrature and sets the current of a blocked leg to zero. Angle, speed
//! and the link's voltage are integrated by the same quadrature.
//!
//! The error is estimated from the third derivative of the currents, which follows from the currents' values and slopes
//! at both ends.

use standstill_inverter::Source;
use standstill_numeric::Wide;

use crate::effect::link::LinkStep;
use crate::effect::rotor::RotorStep;
use crate::effect::terminals::floating::Floating;
use crate::effect::terminals::ringing::Ringing;
use crate::effect::terminals::{TerminalStep, clamp};
use crate::effect::winding::WindingStep;
use crate::effect::{Begin, BranchStep, Effect, End, Looked};
use crate::guard::{Bounds, Margins};
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine, Operating};
use crate::physics::state::State;
use crate::step::error::Accuracy;
use crate::step::hermite::Cubic;

/// The machines at one time, with their states and operating points.
#[derive(Clone, Copy, Debug, Default)]
pub struct Here<V: Wide> {
    /// Time in ns since the start of the run.
    pub time: V,
    /// States of the machines.
    pub state: State<V>,
    /// Operating points of the machines in these states.
    pub at: Operating<V>,
    /// Voltages and slopes of the DC sources.
    pub source: Source<V>,
}

/// An attempted step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tried<V: Wide> {
    /// Length of the step in s.
    pub h: V,
    /// The conduction of the legs during the step.
    pub legs: Conducting<V>,
    /// The machines at the end of the step.
    pub end: Here<V>,
    /// Time derivatives of flux and current at the beginning and at the end of the step.
    pub change: [Change<V>; 2],
    /// The DC links over the step.
    pub link: LinkStep<V>,
    /// The rotors over the step. None if they cannot move.
    pub rotor: Option<RotorStep<V>>,
    /// The floating terminals over the step. None if terminals have no capacitance.
    pub floating: Option<Floating<V>>,
    /// The play cells over the step. None without hysteresis.
    pub branch: Option<BranchStep<V>>,
    /// Phase currents in A at both ends of the step. If terminals have a capacitance, they are the currents of the legs' devices instead.
    pub phases: [[V; 3]; 2],
    /// Margins of the guards at both ends.
    pub margins: [Margins<V>; 2],
    /// Slopes of the phase currents, in A per step, at both ends.
    pub phase_rise: [[V; 3]; 2],
    /// The torque in N·m at both ends.
    pub torque: [V; 2],
    /// Margin of the rotor's motion over the step, as a cubic. The slope of the margin follows from the slope of the torque.
    pub motion: Cubic<V>,
    /// Error of the step relative to the tolerance. The step is acceptable if the error is at most 1. The error is not-a-number if any
    /// part is not-a-number.
    pub error: V,
    /// Margin in V of the blocked leg's potential at the beginning of the step, with the slack added. It is negative if the potential was
    /// out of its bounds already then.
    pub blocked_at_begin: V,
    /// Smallest margin within the step and at its end, with the slack added. It is negative if a mode ends within the step.
    pub least_margin: V,
    /// Smallest margin of legs, comparators and play cells at the end of the step. A larger slack is added, which applies to a step that
    /// is cut at the end of a mode. The margin is negative if the step went too far beyond that end.
    pub least_at_mode_end: V,
}

/// Quantities of the single effects over a step. Either the engine's method or the referee's method computes them.
#[derive(Clone, Copy)]
pub(super) struct Parts<V: Wide> {
    pub link: LinkStep<V>,
    pub rotor: Option<RotorStep<V>>,
    pub ringing: Option<Ringing<V>>,
    pub branch: Option<BranchStep<V>>,
}

impl<V: Wide> Tried<V> {
    /// Attempts a step from `here` to the times `until` in ns. `RARE` says whether machines may have ringing terminals, play cells or
    /// shorted turns.
    #[inline(always)]
    pub fn new<const RARE: bool>(
        machine: &Machine<V>,
        bounds: &Bounds<V>,
        legs: &Conducting<V>,
        here: &Here<V>,
        until: V,
        accuracy: &Accuracy<V>,
    ) -> Self {
        let h = (until - here.time) * 1e-9;
        let first = machine.change::<RARE>(legs, &here.at, &here.state);
        let (branch, short) = (machine.branch_if::<RARE>(), machine.shorted_if::<RARE>());
        let begin = Begin { h, machine, branch, short, legs, here, change: &first };
        let (rotors, links, eddies) = (machine.rotors.as_ref(), &machine.links, machine.circuits.eddies());
        let mut there = Here { time: until, ..*here };

        // Predict.
        let mut rotor = rotors.predict(&begin, &mut there);
        let mut link = links.predict(&begin, &mut there);
        let mut winding = WindingStep::predict(&begin, &link, &mut there);
        let mut terminals = TerminalStep::predicted::<RARE>(&begin, &link, &mut there);
        let mut eddy = eddies.predict(&begin, &mut there);
        let mut shorted = short.predict(&begin, &mut there);
        let mut branched = branch.predict(&begin, &mut there);

        // Evaluate the core.
        let point = some!(branch, branch => branch.at(there.state.flux, Some(first.flux * h)));
        there.at = machine.operating(&there.state, point.as_ref(), short);
        let looked = Looked::at(&there, point, short, legs);
        looked.settle(legs, &mut there);
        winding.predicted = [there.state.flux, there.at.current];
        if let Some(rotors) = rotors {
            rotors.follow(&looked, [looked.flux, looked.current], &mut there);
        }
        let mut last = machine.change::<RARE>(legs, &there.at, &there.state);
        if RARE && short.is_some() {
            // χ depends on these slopes and the slopes on χ: χ is corrected first, then the slopes at the end are computed anew.
            short.correct(&End { begin: &begin, looked: &looked, change: &last }, &mut there, &mut shorted);
            last = machine.change::<RARE>(legs, &there.at, &there.state);
        }

        // Correct.
        let end = End { begin: &begin, looked: &looked, change: &last };
        links.correct(&end, &mut there, &mut link);
        rotors.correct(&end, &mut there, &mut rotor);
        let mut missing = winding.missing(&end, &there, &link);
        if let Some(short) = short {
            missing = missing + short.missing(&end, &there);
        }
        let mut resistance = legs.terminals.resistance;
        if RARE && let Some(terminals) = &mut terminals {
            (missing, resistance) = terminals.correct(&end, &link, winding.predicted[0], &mut there);
        }
        WindingStep::correct(&end, missing, resistance, &mut there);
        if RARE && terminals.is_some() {
            links.correct_again(&end, &mut there, &mut link);
        }
        eddies.correct(&end, &mut there, &mut eddy);
        short.correct(&end, &mut there, &mut shorted);
        looked.settle(legs, &mut there);
        if let (Some(rotors), Some(rotor)) = (rotors, &mut rotor) {
            rotors.finish(&end, winding.predicted, &mut there, rotor);
        }
        if RARE && terminals.is_some() {
            clamp(machine, legs, &mut there);
        }
        branch.correct(&end, &mut there, &mut branched);

        // Estimate the error. The current at the end is extrapolated linearly from the point at which the core was evaluated.
        let off = there.state.flux - looked.flux;
        let mut error = WindingStep::error(&end, &there, off, accuracy);
        if RARE && let Some(terminals) = &terminals {
            error = terminals.error(off, accuracy);
        }
        error = error
            + rotors.error(&rotor, accuracy)
            + eddies.error(&eddy, accuracy)
            + short.error(&shorted, accuracy)
            + links.error(&link, accuracy)
            + branch.error(&branched, accuracy);
        let ringing = some!(terminals, terminals => terminals.ringing);
        Self::between::<RARE>(&end, bounds, there, Parts { link, rotor, ringing, branch: branched }, error)
    }

    /// Completes the record of a step from its known end, and finds out whether modes end within the step.
    #[inline(always)]
    pub(super) fn between<const RARE: bool>(
        of: &End<'_, '_, V>,
        bounds: &Bounds<V>,
        end: Here<V>,
        parts: Parts<V>,
        mut error: V,
    ) -> Self {
        let zero = V::of(0.0);
        let Begin { h, machine, legs, here, change, .. } = *of.begin;
        let Parts { link, rotor, ringing, branch } = parts;
        let changes = [change, of.change];
        let mut phases = [machine.legs.phases(here.at.current), machine.legs.phases(end.at.current)];
        if let Some(elastance) = machine.legs.elastance_if::<RARE>() {
            // A device also carries the current that charges its terminal as the link's voltage changes,
            let capacitance = V::of(1.0) / elastance;
            for (phases, rise) in phases.iter_mut().zip(link.rise) {
                for k in 0..3 {
                    phases[k] = phases[k] + legs.leg[k].rail * rise * capacitance;
                }
            }
            // and the current of the terminal's divider.
            for (phases, state) in phases.iter_mut().zip([&here.state, &end.state]) {
                if let Some(taken) = machine.legs.taken(&state.potential) {
                    *phases = three!(k => phases[k] + V::choose(legs.flows[k], taken[k], zero));
                }
            }
        }
        let mut floating = None;
        if RARE && let Some(ringing) = ringing {
            let mut places =
                Floating::new(machine, legs, [here, &end], changes, &phases, (h, &link), ringing);
            places.exact = error;
            error = error.greatest(places.too_long(machine.lags()));
            floating = Some(places);
        }
        let margins = [
            bounds.margins::<RARE>(machine, legs, here, change, &phases[0]),
            bounds.margins::<RARE>(machine, legs, &end, of.change, &phases[1]),
        ];
        let mut tried = Self {
            h,
            legs: *legs,
            phases,
            margins,
            phase_rise: [machine.legs.phases(change.current * h), machine.legs.phases(of.change.current * h)],
            torque: [here.at.torque, end.at.torque],
            motion: Cubic::default(),
            end,
            change: [*change, *of.change],
            link,
            rotor,
            floating,
            branch,
            error,
            blocked_at_begin: zero,
            least_margin: zero,
            least_at_mode_end: zero,
        };
        tried.look_for_ends::<RARE>(machine, bounds);
        tried
    }
}
