//! Machines side by side: each steps to its own next instant or to the end of one of its modes.

use standstill_interface::Dq;
use standstill_inverter::DcLink;
use standstill_numeric::{Compute, MOST_LANES, Mask, Symmetric, Wide};
use standstill_plant::Motor;

use crate::physics::bounds::{BLOCKED, Bounds, DOMAIN, ENDS, FLUX, MOTION, STOP};
use crate::physics::machine::{Machine, Operating};
use crate::physics::plane::Plane;
use crate::physics::state::State;
use crate::step::ends::{CURRENT_SLACK, POTENTIAL_SLACK};
use crate::step::hermite::Cubic;
use crate::step::two_derivative::{Accuracy, Here, Tried};
use standstill_inverter::Source;

/// Machines of one kind, what they do until when, and what became of it.
#[derive(Clone, Debug)]
pub struct Bank<'a, V: Wide> {
    /// The machines.
    pub machine: Machine<'a, V>,
    /// What ends their modes.
    pub bounds: Bounds<V>,
    /// Where they are.
    pub here: Here<V>,
    /// How exact their steps must be.
    pub accuracy: Accuracy<V>,
    /// A bit for each machine that steps.
    pub live: u32,
    /// The next instant of each in ns, gate edges apart.
    pub stop: V,
    /// Length of the step to try next, and of the longest one, in ns.
    pub hint: V,
    /// See `hint`.
    pub longest: V,
    /// A bit for each machine of which a mode ends at `cut`.
    pub cutting: u32,
    /// In ns.
    pub cut: V,
    /// Which mode that is.
    pub ending: [usize; MOST_LANES],
    /// Largest phase current in A so far.
    pub peak: V,
    /// Furthest from the start in rad so far.
    pub moved: V,
    /// Steps in a row that were not taken.
    pub refused: V,
    /// Accepted steps, and all.
    pub steps: V,
    /// See `steps`.
    pub evaluations: V,
    /// Whether steps are looked at from within: `begin` and `tried` are then those of the last.
    pub follow: bool,
    /// Whether the referee takes the steps of a machine alone.
    pub refereed: bool,
    /// Where the last step began.
    pub begin: Here<V>,
    /// The last step.
    pub tried: Tried<V>,
}

/// What became of a step: a bit for each machine.
#[derive(Clone, Copy, Debug, Default)]
pub struct Served {
    /// Took the step.
    pub accepted: u32,
    /// Is at its next instant, or where a mode ends.
    pub arrived: u32,
    /// A blocked leg's potential was out of its bounds before the step.
    pub unfit: u32,
    /// Changes too fast for any step, or is no number.
    pub broken: u32,
    /// A request to a leg has been carried out: the next one is wanted.
    pub past: [u32; 3],
}

/// What ends where only rounding made a margin negative.
pub const NOTHING: usize = ENDS;

/// So many steps in a row that are not taken end a run: each is shorter than the one before, or is cut where a mode ends.
const MOST_REFUSED: f64 = 200.0;

/// A step in ns below which nothing can be resolved.
const SHORTEST: f64 = 1e-6;

impl<'a, V: Wide> Bank<'a, V> {
    /// For machines of the kind of this one, on this kind of link; `free`: whether rotors can move, `follow`: whether steps
    /// are looked at from within.
    pub fn like(motor: &'a Motor, link: &DcLink, free: bool, follow: bool) -> Self {
        use standstill_plant::Magnetics;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let (plane, dq) = (Plane::new(zero, zero), Dq::new(zero, zero));
        let machine = Machine::like(motor, link, free);
        let rest = State { flux: plane, turned: zero, speed: zero, link: zero, lagging: dq };
        let at = Operating {
            current: plane,
            inverse_inductance: Symmetric::new(one, zero, one),
            turning: plane,
            relaxing: plane,
            energy_turn: plane,
            energy_bend: zero,
            torque: zero,
            cogging_slope: zero,
            core_flux: dq,
            core_current: dq,
            lag: dq,
        };
        let here = Here { time: zero, state: rest, at, source: Source { voltage: zero, rise: zero } };
        let bounds = Bounds::new(motor.magnetics.core().kinks() != [false; 2]);
        let accuracy =
            Accuracy { per_flux: one, per_angle: one, flux_scale: one, per_flux_scale: one, between: zero };
        let tried = Tried::none(&here, machine.legs.at(zero, zero));
        Self {
            machine,
            bounds,
            begin: here.clone(),
            here,
            accuracy,
            live: 0,
            stop: zero,
            hint: zero,
            longest: zero,
            cutting: 0,
            cut: zero,
            ending: [0; MOST_LANES],
            peak: zero,
            moved: zero,
            refused: zero,
            steps: zero,
            evaluations: zero,
            follow,
            refereed: false,
            tried,
        }
    }

    /// Tries a step of each machine that is live. Where a mode ends within it, the next one will end there.
    pub fn step(&mut self) -> Served {
        let (served, crossed) = V::compute(StepOf(self));
        let mut left = crossed;
        while left != 0 {
            let lane = left.trailing_zeros() as usize;
            left &= left - 1;
            self.find_end(lane);
        }
        served
    }

    /// Evaluates a machine anew at its state.
    pub fn look(&mut self, lane: usize) {
        V::compute(LookAt(self, 1 << lane));
    }

    /// The machines at a share of the step taken last.
    pub fn within(&self, share: f64) -> Here<V> {
        V::compute(Within(self, share))
    }

    /// Finds the mode of a machine that ends first within the step just tried, and when.
    fn find_end(&mut self, lane: usize) {
        let tried = &self.tried;
        let one = |pack: &V| pack.get(lane);
        let mut first = (f64::INFINITY, 0);
        let ends = |first: &mut (f64, usize), which: usize, cubic: Cubic<f64>, slack: f64| {
            let to = if cubic.value[1] < -slack {
                1.0
            } else if cubic.dip() < -slack {
                cubic.slope[0] / (cubic.slope[0] - cubic.slope[1])
            } else {
                return;
            };
            let share = cubic.falls_to(-0.5 * slack, 0.0, to);
            if share < first.0 {
                *first = (share, which);
            }
        };
        for k in 0..3 {
            let direction = self.machine.legs.direction(lane, k);
            if direction != 0.0 {
                let value = [0, 1].map(|end: usize| direction * one(&tried.phases[end][k]));
                let slope = [0, 1].map(|end: usize| direction * one(&tried.phase_rise[end][k]));
                ends(&mut first, k, Cubic { value, slope }, CURRENT_SLACK);
            }
        }
        let margin = straight(one(&tried.margins[0][BLOCKED]), one(&tried.margins[1][BLOCKED]));
        // A straight line says little where it begins close to its end: go on by a share at least.
        if margin.value[1] < -POTENTIAL_SLACK {
            let share = margin.falls_to(-0.5 * POTENTIAL_SLACK, 0.0, 1.0).max(0.05);
            if share < first.0 {
                first = (share, BLOCKED);
            }
        }
        let slack = self.bounds.slack.each_ref().map(one);
        if self.machine.rotors.is_some() {
            let torque = tried.torque_margin(&self.machine, &self.bounds);
            let [value, slope] = [torque.value, torque.slope].map(|pair| pair.each_ref().map(one));
            ends(&mut first, MOTION, Cubic { value, slope }, slack[MOTION]);
            let turned = [one(&self.begin.state.turned), one(&tried.end.state.turned)];
            let rise = [one(&self.begin.state.speed), one(&tried.end.state.speed)]
                .map(|speed| speed * one(&tried.h));
            let [lower, upper] = self.bounds.stops.each_ref().map(one);
            ends(
                &mut first,
                STOP,
                Cubic { value: turned.map(|a| upper - a), slope: rise.map(|s| -s) },
                slack[STOP],
            );
            ends(&mut first, STOP, Cubic { value: turned.map(|a| a - lower), slope: rise }, slack[STOP]);
        }
        let margin = |which: usize| [0, 1].map(|end: usize| one(&tried.margins[end][which]));
        let [begin, end] = margin(DOMAIN);
        if end < -slack[DOMAIN] {
            ends(&mut first, DOMAIN, straight(begin, end), slack[DOMAIN]);
        }
        if let Some(sides) = &self.bounds.sides {
            // While the rotor stands, the core's flux changes as the winding's.
            let rise = [0, 1].map(|end: usize| {
                let flux = &tried.change[end].flux;
                [one(&flux.x), one(&flux.y)].map(|rise| rise * one(&tried.h))
            });
            for axis in 0..2 {
                let value = margin(FLUX + axis);
                if value[1] < -slack[FLUX + axis] {
                    let side = one(&sides[axis][0]);
                    let slope = rise.map(|rise| side * rise[axis]);
                    let mut cubic = Cubic { value: [value[0].max(0.0), value[1]], slope };
                    if self.machine.rotors.is_some() {
                        cubic = straight(value[0], value[1]);
                    }
                    ends(&mut first, FLUX + axis, cubic, slack[FLUX + axis]);
                }
            }
        }
        let (share, which) = if first.0.is_finite() { first } else { (1.0, NOTHING) };
        let (from, to) = (self.begin.time.get(lane), tried.end.time.get(lane));
        self.cut.put(lane, (from + (to - from) * share).min(to));
        self.cutting |= 1 << lane;
        self.ending[lane] = which;
    }
}

/// A margin of which no slopes are known.
fn straight(begin: f64, end: f64) -> Cubic<f64> {
    Cubic { value: [begin.max(0.0), end], slope: [end - begin.max(0.0); 2] }
}

/// A step of each machine.
struct StepOf<'b, 'a, V: Wide>(&'b mut Bank<'a, V>);

impl<V: Wide> Compute for StepOf<'_, '_, V> {
    /// What became of it, and a bit for each machine of which a mode ends within the step.
    type Output = (Served, u32);

    #[inline(always)]
    fn compute(self) -> (Served, u32) {
        let bank = self.0;
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let here = &bank.here;
        let (live, cutting) = (V::Mask::of_bits(bank.live), V::Mask::of_bits(bank.cutting));
        let legs = bank.machine.legs.at(here.time, bank.machine.resistance);
        let edge = bank.machine.legs.next_edge(here.time);
        let stop = bank.stop.least(edge);
        let free_end = stop.least(here.time + bank.hint.least(bank.longest));
        let until = V::choose(live, V::choose(cutting, bank.cut, free_end), here.time).greatest(here.time);
        let tried = if V::LANES == 1 && bank.refereed {
            Tried::refereed(&bank.machine, &bank.bounds, &legs, here, until, &bank.accuracy)
        } else {
            Tried::new(&bank.machine, &bank.bounds, &legs, here, until, &bank.accuracy)
        };

        let exact = V::of(1.0 + 1e-12).above(tried.error);
        let unfit = live & zero.above(tried.first);
        let may = live & exact & !unfit;
        let ends = (zero.above(tried.least) & !cutting) | (zero.above(tried.deep) & cutting);
        let crossed = may & ends;
        let accepted = may & !crossed;
        // A cut that is not exact is none: shorter steps find their own.
        bank.cutting &= !(live & !exact & !unfit).bits();
        let length = until - here.time;
        bank.refused = V::only(live & !accepted & !unfit, bank.refused + 1.0);
        let hopeless = bank.refused.above(V::of(MOST_REFUSED));
        let broken = live & ((V::of(SHORTEST).above(length) & !exact & !unfit) | hopeless);

        // The next step's length: the error falls with the fourth power or more. Not-a-number asks for a shorter one.
        let target = V::choose(tried.error.above(-one), tried.error, V::of(1e3)) + 1e-4;
        let factor = (V::of(0.5) / target).sqrt().sqrt().least(V::of(4.0)).greatest(V::of(0.1));
        let next = length * factor;
        // A step that ended at an instant says little about the next one's length.
        let longer = V::choose(bank.hint.above(length), next.greatest(bank.hint), next);
        let hint = V::choose(exact, longer, next.least(length * 0.7));
        bank.hint = V::choose(live & !unfit, hint, bank.hint);

        // Gate edges alone need nobody where a current flows: what they make of the legs follows from the time.
        let at_edge = legs.idle & !edge.above(until);
        let arrived = accepted & (cutting | !bank.stop.above(until) | at_edge);
        let [a, b, c] = bank.machine.legs.past(until);
        let past = [(accepted & a).bits(), (accepted & b).bits(), (accepted & c).bits()];
        bank.steps = bank.steps + V::only(accepted, one);
        bank.evaluations = bank.evaluations + V::only(live, one);
        let [a, b, c] = tried.phases[1];
        bank.peak = bank.peak.greatest(V::only(accepted, a.abs().greatest(b.abs()).greatest(c.abs())));
        if bank.machine.rotors.is_some() {
            bank.moved = bank.moved.greatest(V::only(accepted, tried.end.state.turned.abs()));
        }
        let crossed = crossed.bits();
        let served = Served {
            accepted: accepted.bits(),
            arrived: arrived.bits(),
            unfit: unfit.bits(),
            broken: broken.bits(),
            past,
        };
        if bank.follow {
            bank.begin = bank.here.clone();
            bank.tried = tried.clone();
        } else if crossed != 0 {
            bank.begin.time = bank.here.time;
            bank.begin.state.turned = bank.here.state.turned;
            bank.begin.state.speed = bank.here.state.speed;
            bank.tried.h = tried.h;
            bank.tried.end.time = tried.end.time;
            bank.tried.end.state.turned = tried.end.state.turned;
            bank.tried.end.state.speed = tried.end.state.speed;
            bank.tried.phases = tried.phases;
            bank.tried.phase_rise = tried.phase_rise;
            bank.tried.margins = tried.margins;
            bank.tried.torque = tried.torque;
            bank.tried.torque_rise = tried.torque_rise;
            bank.tried.acceleration = tried.acceleration;
            bank.tried.change = tried.change;
        }
        take(&mut bank.here, &tried.end, accepted);
        (served, crossed)
    }
}

/// Makes the end of a step the place of those that took it.
#[inline(always)]
fn take<V: Wide>(here: &mut Here<V>, end: &Here<V>, accepted: V::Mask) {
    let choose = |yes: V, no: V| V::choose(accepted, yes, no);
    let plane = |yes: Plane<V>, no: Plane<V>| Plane::choose(accepted, yes, no);
    let dq = |yes: Dq<V>, no: Dq<V>| Dq::new(choose(yes.d, no.d), choose(yes.q, no.q));
    let (to, from) = (&here.at, &end.at);
    let (g, h) = (from.inverse_inductance, to.inverse_inductance);
    *here = Here {
        time: choose(end.time, here.time),
        state: State::choose(accepted, &end.state, &here.state),
        at: Operating {
            current: plane(from.current, to.current),
            inverse_inductance: Symmetric::new(choose(g.xx, h.xx), choose(g.xy, h.xy), choose(g.yy, h.yy)),
            turning: plane(from.turning, to.turning),
            relaxing: plane(from.relaxing, to.relaxing),
            energy_turn: plane(from.energy_turn, to.energy_turn),
            energy_bend: choose(from.energy_bend, to.energy_bend),
            torque: choose(from.torque, to.torque),
            cogging_slope: choose(from.cogging_slope, to.cogging_slope),
            core_flux: dq(from.core_flux, to.core_flux),
            core_current: dq(from.core_current, to.core_current),
            lag: dq(from.lag, to.lag),
        },
        source: Source {
            voltage: choose(end.source.voltage, here.source.voltage),
            rise: choose(end.source.rise, here.source.rise),
        },
    };
}

/// Machines evaluated anew at their states: a bit for each.
struct LookAt<'b, 'a, V: Wide>(&'b mut Bank<'a, V>, u32);

impl<V: Wide> Compute for LookAt<'_, '_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let here = &self.0.here;
        let at = self.0.machine.operating(&here.state);
        let there = Here { time: here.time, state: here.state, at, source: here.source };
        take(&mut self.0.here, &there, V::Mask::of_bits(self.1));
    }
}

/// Machines at a share of the step taken last.
struct Within<'b, 'a, V: Wide>(&'b Bank<'a, V>, f64);

impl<V: Wide> Compute for Within<'_, '_, V> {
    type Output = Here<V>;

    #[inline(always)]
    fn compute(self) -> Here<V> {
        self.0.tried.within(&self.0.machine, &self.0.begin, V::of(self.1))
    }
}
