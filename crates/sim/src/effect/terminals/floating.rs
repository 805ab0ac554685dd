//! Floating terminals (no device of their leg conducts) within an attempted step: whether their oscillation may end a mode.

use standstill_numeric::{Lane, Mask, Wide};

use super::modes::Deviation;
use super::ringing::Ringing;
use crate::effect::link::LinkStep;
use crate::physics::legs::Conducting;
use crate::physics::machine::{Change, Machine};
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Here;

/// State of floating terminals over an attempted step.
#[derive(Clone, Copy, Debug)]
pub struct Floating<V: Wide> {
    /// Oscillation of the terminals with the winding.
    pub ringing: Ringing<V>,
    /// Potentials of the terminals in V at both ends of the step.
    pub potential: [[V; 3]; 2],
    /// Slopes of the potentials in V per step at both ends of the step.
    pub rise: [[V; 3]; 2],
    /// Lower and upper bound in V of each leg's potential, beyond which a device conducts, at both ends of the step.
    pub range: [[[V; 2]; 3]; 2],
    /// Slopes of these bounds in V per step at both ends of the step.
    pub moved: [[[V; 2]; 3]; 2],
    /// For each leg the lanes in which the oscillation cannot end the leg's mode, however many periods the step has.
    pub safe: [V::Mask; 3],
    /// Share of the step up to which the oscillation cannot end the mode of a conducting leg that is safe at the beginning of the step but
    /// not at its end; 1 if there is no such leg.
    pub until: V,
    /// Error of the step apart from [`Self::too_long`].
    pub exact: V,
    /// Amplitude of the potentials relative to a large oscillation, whose amplitude is a quarter of the link's voltage;
    /// at most 1.
    pub size: V,
}

/// Square of the largest angle θ in rad by which an eigenmode may turn in a step in which an oscillation may end a leg's
/// mode: up to this angle (0.77 rad) the cubics of currents and potentials locate that end. The error of a cubic is θ⁴/384
/// of the amplitude, 1e-3 at this angle, so a small oscillation may turn further.
pub const SEEN: f64 = 0.6;

/// Value in place of [`SEEN`] for machines with ringing terminals in which eddy currents, shorted turns or play cells react to
/// the flux: up to this angle the cubic of the flux is as exact as the rest of the step.
pub const LAGGED: f64 = 0.09;

impl<V: Wide> Floating<V> {
    /// Describes the terminals over a step of `h` seconds. Each pair holds the values at both ends: states (`places`), time
    /// derivatives (`change`) and the devices' currents in A (`phases`); `link`: the link over the step.
    #[inline(always)]
    pub fn new(
        machine: &Machine<V>,
        legs: &Conducting<V>,
        places: [&Here<V>; 2],
        change: [&Change<V>; 2],
        phases: &[[V; 3]; 2],
        (h, link): (V, &LinkStep<V>),
        ringing: Ringing<V>,
    ) -> Self {
        let zero = V::of(0.0);
        let elastance = machine.legs.elastance.unwrap_or(zero);
        // The oscillators do not contain the reaction of eddy currents, shorted turns and play cells: no leg is safe then.
        let may_turn = if machine.lags() { 0 } else { u32::MAX };
        let mut safe = [V::Mask::of_bits(may_turn); 3];
        let (mut size, mut until) = (zero, V::of(1.0));
        let bounds = three!(k => machine.legs.range(k, &legs.on[k]));
        let range = pair!(e => three!(k => bounds[k].at(places[e].state.link)));
        let moved = pair!(e => three!(k => bounds[k].rise(link.rise[e] * h)));
        let swings = pair!(e => {
            let (here, axes) = (places[e], &machine.legs.axes);
            let [current, rise] = [here.at.current, change[e].current];
            let leak =
                some!(machine.legs.leak, leak => (leak, machine.legs.floating(legs, &here.state.potential)));
            ringing.modes.swing(axes, elastance, [current, rise], leak, h)
        });
        for k in 0..3_usize {
            let [first, second] = pair!(m => {
                Deviation::range([&swings[0].modes[m], &swings[1].modes[m]], k, ringing.turned[m])
            });
            let mut room = [zero; 2];
            for e in 0..2_usize {
                let (here, swing) = (places[e], &swings[e]);
                size = size.greatest(swing.potential[k] * (V::of(4.0) / here.state.link));
                let carried = legs.leg[k].direction * (phases[e][k] - swing.ahead[k]) - swing.current[k];
                let middle = here.state.potential[k] - swing.away[k];
                let [low, high] = range[e][k];
                let held = (middle - low + first[0] + second[0]).least(high - middle - first[1] - second[1]);
                room[e] = V::choose(legs.flows[k], carried, held);
                safe[k] = safe[k] & room[e].above(zero);
            }
            let ends = V::Mask::of_bits(may_turn) & legs.flows[k] & room[0].above(zero) & zero.above(room[1]);
            let fall = V::choose(ends, room[0] - room[1], V::of(1.0));
            until = until.least(V::choose(ends, room[0] / fall, V::of(1.0)));
        }
        let rise = change_of_potential(machine, legs, places, h);
        Self {
            ringing,
            potential: pair!(e => places[e].state.potential),
            rise,
            range,
            moved,
            safe,
            until,
            exact: zero,
            size: size.least(V::of(1.0)),
        }
    }

    /// Returns the square of the largest angle in rad by which an eigenmode turns in the step.
    #[inline(always)]
    pub fn turned(&self) -> V {
        self.ringing.turned[0].greatest(self.ringing.turned[1])
    }

    /// Returns a value above 1 if the step is too long to locate a possible end of a leg's mode within it. `lagged`: whether the
    /// limit is [`LAGGED`] instead of [`SEEN`].
    #[inline(always)]
    pub fn too_long(&self, lagged: bool) -> V {
        let (most, size) = if lagged { (LAGGED, V::of(1.0)) } else { (SEEN, self.size) };
        let turned = self.turned() * (1.0 / most);
        let all_safe = self.safe[0] & self.safe[1] & self.safe[2];
        V::choose(all_safe, V::of(0.0), turned * turned * size)
    }

    /// Returns the distances in V of a terminal's potential from its lower and from its upper bound over the step.
    #[inline(always)]
    pub fn sides(&self, k: usize) -> [Cubic<V>; 2] {
        let (v, rise, range, moved) = (&self.potential, &self.rise, &self.range, &self.moved);
        pair!(of => side(of, pair!(e => [v[e][k], rise[e][k], range[e][k][of], moved[e][k][of]])))
    }

    /// Returns the result of [`Self::sides`] for one lane.
    pub fn sides_of(&self, k: usize, lane: usize) -> [Cubic<f64>; 2] {
        let (v, rise, range, moved) = (&self.potential, &self.rise, &self.range, &self.moved);
        [0, 1].map(|of: usize| {
            side(
                of,
                [0, 1].map(|e: usize| {
                    [&v[e][k], &rise[e][k], &range[e][k][of], &moved[e][k][of]].map(|number| number.get(lane))
                }),
            )
        })
    }
}

/// Returns the distance in V of a potential from its lower (0) or its upper (1) bound over a step. Each array has the
/// potential and the bound at one end of the step, each with its slope per step.
#[inline(always)]
fn side<T: Lane>(of: usize, [begin, end]: [[T; 4]; 2]) -> Cubic<T> {
    let sign = if of == 0 { 1.0 } else { -1.0 };
    Cubic {
        value: [(begin[0] - begin[2]) * sign, (end[0] - end[2]) * sign],
        slope: [(begin[1] - begin[3]) * sign, (end[1] - end[3]) * sign],
    }
}

/// Returns the slopes of the potentials in V per step.
#[inline(always)]
fn change_of_potential<V: Wide>(
    machine: &Machine<V>,
    legs: &Conducting<V>,
    places: [&Here<V>; 2],
    h: V,
) -> [[V; 3]; 2] {
    pair!(e => machine.legs.rise(legs, places[e], h))
}
