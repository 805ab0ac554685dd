//! Sensors with a state (filters, amplifiers, sampling capacitors, pick-up), which is advanced over each step; for machines
//! side by side.

use standstill_numeric::{Compute, Wide};

use super::acquiring::Acquiring;
use super::divided::Divided;
use super::filters::Filters;
use super::pick_up::{Moves, PickedUp};
use super::{Arrangement, SensorSettings, Sensors};
use crate::effect::terminals::ringing::Oscillation;
use crate::effect::terminals::swing::{Powers, cubic};
use crate::physics::legs::Conducting;
use crate::physics::machine::Machine;
use crate::physics::plane::Plane;
use crate::step::two_derivative::{Here, Tried};

/// The parts of the sensors whose outputs depend on the past. A part is none if the machines' sensors do not have it.
#[derive(Clone, Debug)]
pub struct Sensed<V: Wide> {
    /// Filters of the current sensors.
    pub filters: Option<Filters<V>>,
    /// Outputs in A of the slew-rate-limited amplifiers, and their slew rate in A/s.
    slewing: Option<([V; 3], V)>,
    /// The converters' sampling capacitors, which [`Acquiring`] describes.
    acquiring: Option<Acquiring<V>>,
    /// Pick-up of switching edges in the current readings.
    pub picked_up: Option<PickedUp<V>>,
    /// Filters behind the dividers of terminals with a capacitance.
    pub divided: Option<Divided<V>>,
    /// Arrangement of the current sensors.
    arrangement: Arrangement,
    passed: Passed<V>,
}

/// The quantities of the last step that the sensors need.
#[derive(Clone, Debug, Default)]
struct Passed<V: Wide> {
    /// Lanes whose machines accepted the step.
    taken: V::Mask,
    /// Beginning of the step in ns.
    time: V,
    /// Length of the step in s.
    h: V,
    legs: Conducting<V>,
    /// Currents in A at both ends.
    current: [Plane<V>; 2],
    /// Slopes of the currents in A/s at both ends.
    rise: [Plane<V>; 2],
    /// Oscillation of the currents. None if the terminals have no capacitance.
    ringing: Option<Oscillating<V>>,
    /// The filters at the beginning of the step.
    filters: Option<Filters<V>>,
    /// The pick-up at the beginning of the step.
    picked_up: Option<PickedUp<V>>,
    /// Cubic part of each filter's input, in A.
    input: [Powers<V>; 3],
    /// Factors of the two oscillations in the input of each filter.
    shares: [[V; 3]; 2],
    /// Movement of the terminals' potentials, which causes pick-up. None if the terminals have no capacitance.
    moves: Option<Moves<V>>,
}

/// Oscillations of the currents over a step.
#[derive(Clone, Copy, Debug)]
pub struct Oscillating<V> {
    /// The two modal oscillations.
    pub of: [Oscillation<V>; 2],
    /// Vectors by which the modal oscillations are multiplied to obtain the current in A.
    pub to: [Plane<V>; 2],
    /// Change of a terminal's potential by a charge of 1 A·s, as a multiple of the link's voltage.
    pub per_charge: V,
}

impl<V: Wide> Sensed<V> {
    /// Makes sensors of the same kind as those with these settings. None if no sensor has a state. `capacitive` says whether the
    /// terminals have a capacitance.
    pub fn like(settings: &SensorSettings, capacitive: bool) -> Option<Self> {
        let filters = settings.bandwidth.is_some();
        let (acquiring, slewing) = (settings.acquisition > 0.0, settings.slews());
        let divided = settings.divides(capacitive);
        let there = filters || settings.pick_up.is_some() || acquiring || slewing || divided;
        there.then(|| Self {
            filters: filters.then(Filters::default),
            slewing: slewing.then(|| ([V::of(0.0); 3], V::of(0.0))),
            acquiring: acquiring.then(Acquiring::default),
            picked_up: settings.pick_up.map(|_| PickedUp::default()),
            divided: divided.then(Divided::default),
            arrangement: settings.arrangement,
            passed: Passed::default(),
        })
    }

    /// Returns whether sensors with these settings are of the same kind as the sensors `of`.
    pub fn fits(of: Option<&Self>, settings: &SensorSettings, capacitive: bool) -> bool {
        let plain = settings.bandwidth.is_none() && settings.pick_up.is_none() && settings.acquisition == 0.0;
        let divided = settings.divides(capacitive);
        let Some(sensed) = of else { return plain && !settings.slews() && !divided };
        sensed.slewing.is_some() == settings.slews()
            && sensed.acquiring.is_some() == (settings.acquisition > 0.0)
            && sensed.filters.is_some() == settings.bandwidth.is_some()
            && sensed.picked_up.is_some() == settings.pick_up.is_some()
            && sensed.divided.is_some() == divided
            && sensed.arrangement == settings.arrangement
    }

    /// Sets the parameters of a lane's sensors, and sets their outputs to those at zero current.
    pub fn put(&mut self, lane: usize, sensors: &Sensors) {
        if let (Some(filters), Some(bandwidth)) = (&mut self.filters, sensors.settings.bandwidth) {
            filters.put(lane, sensors.corner.map(|share| bandwidth * share));
        }
        if let Some((output, rate)) = &mut self.slewing {
            for output in output {
                output.put(lane, 0.0);
            }
            rate.put(lane, sensors.settings.slew);
        }
        if let Some(acquiring) = &mut self.acquiring {
            let time_constants = sensors.settings.bandwidth.map(|bandwidth| {
                sensors.corner.map(|share| 1.0 / (std::f64::consts::TAU * bandwidth * share))
            });
            acquiring.put(lane, sensors.settings.acquisition, time_constants);
        }
        if let (Some(picked_up), Some(of)) = (&mut self.picked_up, sensors.settings.pick_up) {
            picked_up.put(lane, of);
        }
    }

    /// Returns the present outputs in A of a lane's current sensors. `current` contains the present currents in A at their inputs.
    pub fn at(&self, lane: usize, current: [f64; 3]) -> [f64; 3] {
        let mut shown = current;
        if let Some(filters) = &self.filters {
            shown = filters.output.each_ref().map(|output| output.get(lane));
        }
        if let Some((output, _)) = &self.slewing {
            shown = output.each_ref().map(|output| output.get(lane));
        }
        if let Some(acquiring) = &self.acquiring {
            shown = std::array::from_fn(|k| {
                let share = acquiring.of_sensors[k].get(lane);
                share * if share == 0.0 { 0.0 } else { shown[k] }
                    + (1.0 - share) * acquiring.filters.output[k].get(lane)
            });
        }
        let added = self.picked_up.as_ref().map_or(0.0, |picked_up| picked_up.at(lane));
        shown.map(|shown| shown + added)
    }

    /// Returns the outputs in A of a lane's current sensors within the last step, after filters and with pick-up. `times` contains for
    /// each phase its own time in ns.
    pub fn within(&self, lane: usize, times: [f64; 3]) -> [f64; 3] {
        V::compute(Within(&self.passed, lane, times))
    }

    /// Returns the outputs in V of the filters behind a lane's dividers at `time` in ns within the last step. None without these filters.
    pub fn divided_within(&self, lane: usize, time: f64) -> Option<[f64; 3]> {
        let (passed, h) = (&self.passed, self.passed.h.get(lane));
        let share = ((time - passed.time.get(lane)) * (1e-9 / h)).clamp(0.0, 1.0);
        Some(self.divided.as_ref()?.within(lane, share, h, passed.ringing.as_ref()))
    }

    /// Stores the quantities of a step that the sensors need. This happens before the end of the step replaces the present state of the
    /// machines that accepted the step.
    #[inline(always)]
    pub fn keep<const RARE: bool>(
        &mut self,
        taken: V::Mask,
        begin: &Here<V>,
        tried: &Tried<V>,
        machine: &Machine<V>,
    ) {
        let passed = &mut self.passed;
        passed.taken = taken;
        passed.time = begin.time;
        passed.h = tried.h;
        passed.legs = tried.legs;
        passed.current = [begin.at.current, tried.end.at.current];
        passed.rise = [tried.change[0].current, tried.change[1].current];
        if RARE && let (Some(floating), Some(elastance)) = (&tried.floating, machine.legs.elastance) {
            // The slopes after the correction of the potentials: a volt changes a slope by about a hundred amperes per millisecond.
            let end = &tried.end;
            passed.rise[1] = machine.change::<RARE>(&tried.legs, &end.at, &end.state).current;
            passed.ringing = Some(Oscillating {
                of: floating.ringing.oscillations(),
                to: floating.ringing.modes.to,
                per_charge: elastance / tried.end.state.link,
            });
            if let Some(divided) = &mut self.divided {
                divided.keep(begin, tried, machine);
            }
        }
    }

    /// Advances the sensors over the stored step. `axes` contains the magnetic axes of the legs' phases.
    pub fn follow(&mut self, axes: &[Plane<V>; 3]) {
        V::compute(Follow(self, axes));
    }

    /// Advances the sensors in the lanes of `taken` by `h` seconds in which no current flows and no potential moves. `legs` is the
    /// conduction of the legs during this time.
    #[inline(always)]
    pub fn rest(&mut self, taken: V::Mask, h: V, legs: &Conducting<V>) {
        let none = [V::of(0.0); 4];
        if let Some(filters) = &mut self.filters {
            filters.advance(taken, h, &[none; 3], None);
        }
        if let Some(acquiring) = &mut self.acquiring {
            acquiring.filters.advance(taken, h, &[none; 3], None);
        }
        self.slew(taken, h, [V::of(0.0); 3]);
        if let Some(picked_up) = &mut self.picked_up {
            picked_up.follow(taken, legs);
            picked_up.advance(taken, h, None);
        }
    }
}

impl<V: Wide> Sensed<V> {
    /// Advances the slew-rate-limited amplifiers by `h` seconds. Their input is the filters' output or, without filters, the current
    /// `seen` in A through the shunts. Only its value at the end of this time is needed: apart from jumps at gate edges, a current
    /// changes more slowly than the slew rate.
    #[inline(always)]
    fn slew(&mut self, taken: V::Mask, h: V, seen: [V; 3]) {
        let Some((output, rate)) = &mut self.slewing else { return };
        let mut input = seen;
        if let Some(filters) = &self.filters {
            input = filters.output;
        }
        for k in 0..3 {
            let most = *rate * h;
            let next = input[k].greatest(output[k] - most).least(output[k] + most);
            output[k] = V::choose(taken, next, output[k]);
        }
    }
}

/// Computes the outputs of a lane's current sensors, for each phase at its own time in ns.
struct Within<'s, V: Wide>(&'s Passed<V>, usize, [f64; 3]);

impl<V: Wide> Compute for Within<'_, V> {
    type Output = [f64; 3];

    #[inline(always)]
    fn compute(self) -> [f64; 3] {
        let Self(passed, lane, times) = self;
        let h = passed.h.get(lane);
        let mut shown = [0.0; 3];
        let mut first = 0;
        while first < 3 {
            let count = V::LANES.min(3 - first);
            let mut time = V::of(times[first]);
            for n in 1..count {
                time.put(n, times[first + n]);
            }
            let share = (time - passed.time.get(lane)) * (1e-9 / h);
            let share = share.greatest(V::of(0.0)).least(V::of(1.0));
            let mut sum = V::of(0.0);
            let of = some!(&passed.ringing, ringing => pair!(m => ringing.of[m].of_lane(lane, share)));
            if let Some(filters) = &passed.filters {
                let rings = some!(&of, of => (of, &passed.shares));
                sum = filters.within(lane, first, share, h, &passed.input, rings);
            }
            if let Some(picked_up) = &passed.picked_up {
                let moves = passed.moves.as_ref().zip(of.as_ref());
                sum = sum + picked_up.within(lane, share, h, moves);
            }
            for n in 0..count {
                shown[first + n] = sum.get(n);
            }
            first += count;
        }
        shown
    }
}

/// Advances the sensors over the stored step.
struct Follow<'s, V: Wide>(&'s mut Sensed<V>, &'s [Plane<V>; 3]);

impl<V: Wide> Compute for Follow<'_, V> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let Self(sensed, axes) = self;
        let passed = &mut sensed.passed;
        let (taken, h) = (passed.taken, passed.h);
        let (zero, one) = (V::of(0.0), V::of(1.0));
        let mut value = passed.current;
        let mut slope = [passed.rise[0] * h, passed.rise[1] * h];
        let ringing = passed.ringing;
        if let Some(divided) = &mut sensed.divided {
            divided.advance(taken, h, &passed.legs, &passed.rise, axes, ringing.as_ref());
        }
        if let Some(ringing) = &ringing {
            for m in 0..2 {
                let to = ringing.to[m];
                let ([re, im], [decay, turn]) = (ringing.of[m].phasor, ringing.of[m].turns);
                let [over, turned] = ringing.of[m].over;
                let rise = [re * decay - im * turn, re * turn + im * decay];
                value[0] = value[0] - to * re;
                value[1] = value[1] - to * (re * over - im * turned);
                slope[0] = slope[0] - to * rise[0];
                slope[1] = slope[1] - to * (rise[0] * over - rise[1] * turned);
            }
        }
        let x = cubic([value[0].x, value[1].x], [slope[0].x, slope[1].x]);
        let y = cubic([value[0].y, value[1].y], [slope[0].y, slope[1].y]);
        if let Some(picked_up) = &mut sensed.picked_up {
            passed.moves = None;
            if let Some(Oscillating { to, per_charge, .. }) = &ringing {
                // The currents of floating terminals change their potentials.
                let mut axis = Plane::new(zero, zero);
                for k in 0..3 {
                    axis = axis - axes[k] * V::choose(passed.legs.flows[k], zero, *per_charge * h);
                }
                let mut cubic = x;
                for n in 0..4 {
                    cubic[n] = axis.x * x[n] + axis.y * y[n];
                }
                passed.moves = Some(Moves { cubic, shares: pair!(m => axis.dot(to[m])) });
            } else {
                picked_up.follow(taken, &passed.legs);
            }
            passed.picked_up = Some(*picked_up);
            let moves =
                some!(passed.moves.as_ref().zip(ringing.as_ref()), (moves, ringing) => (moves, &ringing.of));
            picked_up.advance(taken, h, moves);
        }
        if sensed.filters.is_none() && sensed.slewing.is_none() && sensed.acquiring.is_none() {
            return;
        }
        passed.filters = sensed.filters;
        let mut seen = [one; 3];
        if sensed.arrangement.follows_legs() {
            let half = V::of(0.5);
            let lower = sensed.arrangement == Arrangement::LowSideShunts;
            seen = three!(k => {
                let upper = passed.legs.leg[k].rail.above(half);
                V::only(passed.legs.flows[k] & if lower { !upper } else { upper }, one)
            });
        }
        if let Some(ringing) = &ringing {
            passed.shares = pair!(m => three!(k => axes[k].dot(ringing.to[m]) * seen[k]));
        }
        for k in 0..3 {
            for n in 0..4 {
                passed.input[k][n] = (axes[k].x * x[n] + axes[k].y * y[n]) * seen[k];
            }
        }
        if sensed.arrangement == Arrangement::DcLinkShunt {
            for n in 0..4 {
                let [a, b, c] = three!(k => passed.input[k][n]);
                (passed.input[0][n], passed.input[1][n], passed.input[2][n]) = (a + b + c, zero, zero);
            }
            passed.shares = pair!(m => {
                let [a, b, c] = passed.shares[m];
                [a + b + c, zero, zero]
            });
        }
        let rings = some!(&ringing, ringing => (&ringing.of, &passed.shares));
        if let Some(filters) = &mut sensed.filters {
            filters.advance(taken, h, &passed.input, rings);
        }
        if let Some(acquiring) = &mut sensed.acquiring {
            acquiring.filters.advance(taken, h, &passed.input, rings);
        }
        if sensed.slewing.is_none() {
            return;
        }
        let mut at_end = [zero; 3];
        for k in 0..3 {
            let [a, b, c, d] = passed.input[k];
            at_end[k] = a + b + c + d;
        }
        if let Some(ringing) = &ringing {
            for m in 0..2 {
                let ([re, im], [over, turned]) = (ringing.of[m].phasor, ringing.of[m].over);
                for k in 0..3 {
                    at_end[k] = at_end[k] + passed.shares[m][k] * (re * over - im * turned);
                }
            }
        }
        sensed.slew(taken, h, at_end);
    }
}
