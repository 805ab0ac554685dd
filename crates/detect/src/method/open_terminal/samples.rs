//! What the samples of a pulse show: for which instant, and after which resistive drop.

use standstill_interface::{Angle, Nanos, Real};

use super::OpenTerminal;
use crate::parts::instant;

impl<T: Real> OpenTerminal<T> {
    /// Returns the instant in s for which the axis holds. Induced by a current `i = U t/L` that grows, a terminal shows
    /// `d(M i)/dt = M di/dt + i dM/dt`, and both parts are equal in size if M changes at a constant rate: so the M that it shows at the time t
    /// is that of the time 2t. At the angle x from the axis M has a part with sin 2x, which tells most of the axis along and across it.
    pub(super) fn instant(&self, axis: Angle<T>) -> T {
        let s = &self.settings;
        let (from, to) = s.window();
        let middle = (s.time(from).seconds() + s.time(to.max(1) - 1).seconds()) / 2.0;
        let seen = 2.0 * middle - s.dead_time.seconds();
        let pulses = 2 * u64::from(self.rounds);
        let begins = self.begins.map(|begins| T::of(Nanos(begins / pulses).seconds()));
        T::of(seen) + instant::of_terminals(axis, begins)
    }

    /// Returns the share of a line's voltage that is left across an inductance in H after the resistive drop: the mean
    /// of `e^(−2 R t/L)` over the used samples.
    pub(super) fn left(&self, inductance: T) -> T {
        let s = &self.settings;
        let (from, to) = s.window();
        let per_time = T::of(2.0) * s.resistance / inductance;
        // Samples are equally spaced, so their exponentials are a geometric series.
        let first = T::of((s.time(from) - s.dead_time).seconds());
        let ratio = per_time * T::of(s.interval.seconds());
        let count = T::of((to - from) as f64);
        let begin = (-per_time * first).exp();
        if ratio.abs() < T::of(1e-6) {
            return begin * (T::one() - ratio * (count - T::one()) / T::of(2.0));
        }
        begin * (-ratio * count).exp_m1() / ((-ratio).exp_m1() * count)
    }
}
