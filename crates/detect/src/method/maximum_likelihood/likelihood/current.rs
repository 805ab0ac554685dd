//! The current of a line's forward and backward pulses, side by side, and its derivatives with respect to the
//! parameters.

use core::ops::Mul;

use standstill_interface::{Arithmetic, Real};

use super::both::Both;
use super::lag::{Memory, Response};

/// The direction of a pulse along its line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Way {
    Backward,
    Forward,
}

/// Known quantities of a pulse and its samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PulseModel<T> {
    /// Voltage in V across the line while the pulse lasts.
    pub on: T,
    /// Voltage in V against the current afterwards.
    pub off: T,
    /// Resistance in Ω of the line.
    pub resistance: T,
    /// Length of the pulse in s.
    pub pulse: T,
    /// Interval between samples in s; the first sample is one interval after the start.
    pub interval: T,
    /// Time in s after an edge of the legs during which samples are left out, until the pick-up of the edge has
    /// decayed.
    pub blank: T,
    /// Time in s before the end of the pulse during which samples are left out: jitter may move them beyond the end,
    /// where a shunt in the DC link shows the current with the opposite sign.
    pub before_end: T,
}

/// Parameters of a current: L in H, c in H/A, both of its line, and t_s in s; and how it is seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LineParameters<T> {
    pub inductance: T,
    pub slope: T,
    pub delay: T,
    /// Time constant τ of the sensors in s; zero if they have no lag.
    pub lag: T,
    /// Delay in s between the trigger and the sampling.
    pub late: T,
}

/// The current in A and its slopes over L, c and t_s.
#[derive(Clone, Copy, Debug)]
pub(super) struct Flow<V> {
    pub current: V,
    pub slopes: [V; 3],
}

impl<V: Arithmetic> Flow<V> {
    #[inline(always)]
    fn plus<T: Copy>(&self, rate: &Self, time: T) -> Self
    where
        V: Mul<T, Output = V>,
    {
        let ([l, c, t], [dl, dc, dt]) = (self.slopes, rate.slopes);
        Self {
            current: self.current + rate.current * time,
            slopes: [l + dl * time, c + dc * time, t + dt * time],
        }
    }
}

impl<T: Real> PulseModel<T> {
    /// Returns whether a sample at `time` in s is too near to the edge at the begin or at the end of the pulse.
    fn near_an_edge(&self, time: T, delay: T) -> bool {
        let since = |edge: T| time >= edge && time - edge < self.blank;
        let turns = self.before_end > T::zero() && (time - self.pulse).abs() < self.before_end;
        turns || self.blank > T::zero() && (since(delay) || since(self.pulse))
    }

    /// Calls `sample` for each sample of the pulses in one direction.
    #[cfg(test)]
    pub fn one_way(
        &self,
        p: &LineParameters<T>,
        forward: bool,
        count: usize,
        mut sample: impl FnMut(usize, T, [T; 4]),
    ) {
        let wanted = if forward { Way::Forward } else { Way::Backward };
        self.follow(p, count, |k, way, current, slopes| {
            if way == wanted {
                sample(k, current, slopes);
            }
        });
    }

    /// Calls `sample` with number, way, current and its slopes over L, c, t_s and τ, of each sample while the current flows:
    /// of pulses both ways, side by side.
    pub fn follow(&self, p: &LineParameters<T>, count: usize, mut sample: impl FnMut(usize, Way, T, [T; 4])) {
        let zero = T::zero();
        let all = Both::all;
        let signs = Both([-T::one(), T::one()]);
        let saturation = signs * p.slope;
        let rate = |at: &Flow<Both<T>>, voltage: T| {
            let inductance = all(p.inductance) - saturation * at.current;
            let f = (all(voltage) - at.current * self.resistance) / inductance;
            let over_current = (f * saturation - all(self.resistance)) / inductance;
            Flow {
                current: f,
                slopes: [
                    over_current * at.slopes[0] - f / inductance,
                    over_current * at.slopes[1] + f * signs * at.current / inductance,
                    over_current * at.slopes[2],
                ],
            }
        };
        // Later by dt is less by di/dt at the start.
        let none = Flow { current: all(zero), slopes: [all(zero); 3] };
        let start = -rate(&none, self.on).current;
        let mut at = Flow { slopes: [all(zero), all(zero), start], ..none };
        let mut now = p.delay;
        let mut voltage = self.on;
        let mut memory = Memory::new(all(zero));
        let mut response = Response::of(zero);
        let mut over = [false; 2];
        for k in 0..count {
            let then = self.interval * T::of((k + 1) as f64) + p.late;
            while now < then {
                let on = now < self.pulse;
                if !on {
                    voltage = -self.off;
                }
                let end = if on { then.min(self.pulse) } else { then };
                let (next, begin) = step(&at, end - now, |at| rate(at, voltage));
                if p.lag > zero {
                    response = response.at((end - now) / p.lag);
                    memory.follow(&response, &at, &begin, &next, end - now);
                }
                (at, now) = (next, end);
            }
            for (over, current) in over.iter_mut().zip(at.current.0) {
                *over = *over || current < zero;
            }
            if over == [true; 2] {
                return;
            }
            if then >= p.delay && !self.near_an_edge(then, p.delay) {
                let (current, slopes) = if p.lag > zero {
                    (memory.seen.current, memory.slopes(p.lag))
                } else {
                    let [l, c, t] = at.slopes;
                    (at.current, [l, c, t, all(zero)])
                };
                for (n, way) in [Way::Backward, Way::Forward].into_iter().enumerate() {
                    if !over[n] {
                        sample(k, way, current.0[n], slopes.map(|slope| slope.0[n]));
                    }
                }
            }
        }
    }
}

/// Takes one step of the classical Runge–Kutta method, and returns it with the rate at its beginning. With steps of a
/// twentieth of a pulse, its error is far below any sensor's.
///
/// Arguments and result are passed in memory, pair by pair, so that the compiler recognises that two numbers are
/// computed alike.
#[inline(never)]
fn step<T: Real>(
    at: &Flow<Both<T>>,
    time: T,
    rate: impl Fn(&Flow<Both<T>>) -> Flow<Both<T>>,
) -> (Flow<Both<T>>, Flow<Both<T>>) {
    let half = time / T::of(2.0);
    let k1 = rate(at);
    let k2 = rate(&at.plus(&k1, half));
    let k3 = rate(&at.plus(&k2, half));
    let k4 = rate(&at.plus(&k3, time));
    let (sixth, two) = (time / T::of(6.0), T::of(2.0));
    let end = at.plus(&k1, sixth).plus(&k2, sixth * two).plus(&k3, sixth * two).plus(&k4, sixth);
    (end, k1)
}
