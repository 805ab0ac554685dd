//! Pulse-width modulation that one shunt in the DC link can sample.
//!
//! ```text
//!   first half of a period:  all low ─► [one leg high] ─► [two legs high] ─► all high
//!                                        its current       minus that of the leg that is low
//! ```
//! Within half a carrier period the legs rise one after the other, and between two rises the shunt shows the current of
//! one leg. With small voltages the legs rise nearly at once. Then the first leg's edges are shifted to be earlier and
//! the last leg's to be later, equally in both halves of the period. Each leg is high for the same time as before, so
//! the mean voltage of each period is unchanged.
//!
//! Within the period the shifted edges and the ripple move the current at the two samples. In the next period the same
//! voltage is given backwards in time, with windows in its second half: with the charge of voltage `q(t) = ∫ u dt'` of
//! the first period a sample at t has `i(0) + Γ q(t)`, its mirror image in the second one `i(0) + Γ (2 q(T) − q(t))`,
//! and the mean of both is `i(0) + Γ q(T)`: the current in the middle of the pair, independently of Γ with the motor's
//! saliency, and of the shift. Only the drop R·i of the ripple remains as an error.

use standstill_interface::{
    Abc, AlphaBeta, Command, Fault, Leg, Nanos, Phase, Reading, Real, Sampling, Stage, choice,
};

use crate::nameplate::{Nameplate, Place};
use crate::parts::modulation::ModulationSettings;
use crate::parts::settle::{link, link_current};
use crate::settings::{SettingsError, require};

/// Jitter that a sample may have within its window.
const MARGIN: Nanos = Nanos(400);

/// Settings of the windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSettings<T> {
    /// Least length of each of the two vectors between the rises of two legs.
    pub length: Nanos,
    /// Time from the first conversion of a sample to its last one. Samples lie in the middle of a window, mirrored or
    /// not.
    pub averaged: Nanos,
    /// The shortest window in which the amplifier settles and a sample is converted.
    pub shortest: Nanos,
    /// Nominal voltage of the link in V, from which the room for windows is computed.
    pub dc_link: T,
    /// The key that has the largest part in [`Self::shortest`].
    pub binds: Bind,
}

choice! {
    /// Cause of long windows, with the key that sets it.
    pub enum Bind {
        /// Readings are believed no earlier after an edge.
        Settle = "sensors.settle",
        /// What edges add to readings takes so long to decay.
        PickUp = "sensors.pick_up_decay",
        /// A leg switches later than the request by this time.
        DeadTime = "inverter.dead_time",
        /// A reading is the mean of several conversions.
        Oversampling = "sensors.oversampling",
    }
}

impl Bind {
    /// Returns the requirement on a window, and the advice that makes room for it.
    const fn words(self) -> [&'static str; 2] {
        macro_rules! words {
            ($key:literal) => {
                [
                    concat!("long enough for a sample in its middle, mirrored or not: `", $key, "` has the largest part in that"),
                    concat!(
                        "short enough for both windows beside the leg in the middle: a lower `inverter.carrier`, `detector.voltage` or `",
                        $key,
                        "` makes room"
                    ),
                ]
            };
        }
        match self {
            Self::Settle => words!("sensors.settle"),
            Self::PickUp => words!("sensors.pick_up_decay"),
            Self::DeadTime => words!("inverter.dead_time"),
            Self::Oversampling => words!("sensors.oversampling"),
        }
    }
}

impl<T: Real> WindowSettings<T> {
    /// Returns the windows of a drive with one shunt in its DC link; none for other drives.
    pub(crate) fn suited(drive: &Nameplate<T>) -> Option<Self> {
        let sensing = &drive.sensing;
        let blank = Nanos::from_seconds(sensing.blank().to_double());
        let settled = blank.max(drive.dead_time) + MARGIN;
        let binds = if sensing.averaged > settled * 2 {
            Bind::Oversampling
        } else if drive.dead_time > blank {
            Bind::DeadTime
        } else if sensing.blank_key() == Bind::PickUp.name() {
            Bind::PickUp
        } else {
            Bind::Settle
        };
        // In the mirrored period, the time after a sample lies before it, so both sides must be settled.
        let length = settled * 2 + sensing.averaged;
        (sensing.place == Place::InLink).then_some(Self {
            length,
            averaged: sensing.averaged,
            shortest: length,
            dc_link: drive.dc_link,
            binds,
        })
    }

    /// Returns the largest voltage in V, for any direction, that leaves room for both windows around the middle leg in
    /// half a carrier period; not positive if there is no such voltage.
    ///
    /// The middle leg has at most half of the voltage; an edge moves by the largest loss of both legs by dead time and
    /// drops.
    pub(crate) fn room(&self, pwm: &ModulationSettings<T>) -> T {
        let (half, two) = (T::of(0.5), T::of(2.0));
        let left = half - two * pwm.lost(self.dc_link);
        let window = two * T::of(self.length.seconds()) / T::of(pwm.carrier_period.seconds());
        left.min(two * (left - window)) * self.dc_link
    }

    /// Checks that the windows have their length and their room at this voltage.
    pub(crate) fn check(&self, pwm: &ModulationSettings<T>, voltage: T) -> Result<(), SettingsError> {
        let [long, short] = self.binds.words();
        require(self.length >= self.shortest, "window", long)?;
        require(voltage <= self.room(pwm), "window", short)
    }

    /// Returns a carrier period with this voltage in V in which both windows are long enough, in the first half of the
    /// period or, if mirrored, in the second half; `currents`: as for [`ModulationSettings::command`].
    ///
    /// Dead time is compensated at each edge: it delays the rise of a leg whose current is positive, but not its fall,
    /// so a mean over both edges would make the two periods unequal.
    pub(crate) fn period(
        &self,
        pwm: &ModulationSettings<T>,
        voltage: AlphaBeta<T>,
        dc_link: T,
        currents: [Abc<T>; 2],
        mirrored: bool,
    ) -> Command<T> {
        let order = order(voltage);
        let half = pwm.carrier_period.0 / 2;
        let rest = pwm.carrier_period.0 - half;
        let signed = |time: u64| i64::try_from(time).unwrap_or(i64::MAX);
        let of_half =
            |share: T| signed(Nanos::from_seconds(share.to_double() * half as f64 * 1e-9).0.min(half));
        let (most, window) = (signed(half), signed(self.length.0));
        // How long before the middle of the period each leg is high, and after it.
        let duties = ModulationSettings::plain(voltage, dc_link);
        let on = order.map(|phase| of_half(duties[phase]));
        let [first, middle, last] = on;
        let before = [first.max(middle + window), middle, last.min(middle - window)];
        let before = before.map(|time| time.clamp(0, most));
        let after: [i64; 3] = core::array::from_fn(|n| (2 * on[n] - before[n]).clamp(0, most));
        let times = if mirrored { [after, before] } else { [before, after] };
        let shares = times.map(|times| {
            let mut high = Abc([T::zero(); 3]);
            for (time, phase) in times.into_iter().zip(order) {
                high[phase] = T::of(time as f64 / half as f64);
            }
            high
        });
        let signs = pwm.signs(shares, dc_link, currents);
        // `lost` is a share of the period; times a sign from 0 to 2 it is a share of half a period.
        let lost = pwm.lost(dc_link);
        let mut stages = [Abc([Leg::Low; 3]); 2];
        for (n, phase) in order.into_iter().enumerate() {
            let [rise, fall] =
                [T::one() + signs[0][phase], T::one() - signs[1][phase]].map(|sign| of_half(lost * sign));
            let unsigned = |time: i64| Nanos(u64::try_from(time).unwrap_or(0));
            stages[0][phase] = high(unsigned(times[0][n] + rise), Nanos(half), false);
            stages[1][phase] = high(unsigned(times[1][n] - fall), Nanos(rest), true);
        }
        // Before the second leg rises and before the third one does; mirrored, as long after each has fallen.
        let before_end = signed(u64::midpoint(self.length.0, self.averaged.0));
        let samples =
            [before[1], before[2]].map(|time| Nanos(u64::try_from(most - time - before_end).unwrap_or(0)));
        let back = |at: Nanos| pwm.carrier_period - at - self.averaged;
        let samples = if mirrored { [back(samples[1]), back(samples[0])] } else { samples };
        let [one, two] = stages;
        Command::sequence(
            Stage { legs: one, duration: Nanos(half) },
            Stage { legs: two, duration: Nanos(rest) },
            Sampling::twice(samples[0], samples[1]),
        )
    }
}

/// Returns a leg that is high for `time` of half a period, adjacent to the middle of the period.
fn high<T>(time: Nanos, half: Nanos, second: bool) -> Leg<T> {
    match time {
        Nanos::ZERO => Leg::Low,
        time if time >= half => Leg::High,
        time if second => Leg::Fall(time),
        time => Leg::Rise(half - time),
    }
}

/// Returns the phases in the order in which they rise for a voltage in V.
pub(crate) fn order<T: Real>(voltage: AlphaBeta<T>) -> [Phase; 3] {
    let volts = voltage.phases();
    let mut order = Phase::ALL;
    for (n, m) in [(0, 1), (1, 2), (0, 1)] {
        if volts[order[n]] < volts[order[m]] {
            order.swap(n, m);
        }
    }
    order
}

/// Returns the currents in A of the first and the last leg from the readings of a period; `offset`: the shunt's reading
/// without current.
pub(crate) fn seen<T: Real>(
    readings: &[Reading<T>],
    mirrored: bool,
    offset: T,
) -> Result<([T; 2], T), Fault<T>> {
    let [first, second] = readings else { return Err(Fault::UnexpectedReadings) };
    let (high, low) = if mirrored { (second, first) } else { (first, second) };
    // The current of the only leg that is high, and that of the only leg that is low.
    let currents = [link_current(high)? - offset, offset - link_current(low)?];
    link(first)?;
    Ok((currents, link(second)?))
}

/// Returns the phase currents in A from those of the first and the last leg.
pub(crate) fn phases<T: Real>([first, last]: [T; 2], order: [Phase; 3]) -> Abc<T> {
    let mut currents = Abc([T::zero(); 3]);
    currents[order[0]] = first;
    currents[order[1]] = -(first + last);
    currents[order[2]] = last;
    currents
}

/// Returns the variance of the component, along a unit vector, of a current from [`phases`], relative to the variance
/// of one reading, while the voltage is along `voltage`. Each of the two legs' currents is the mean of two readings.
pub(crate) fn variance<T: Real>(voltage: AlphaBeta<T>, direction: AlphaBeta<T>) -> T {
    let (zero, one) = (T::zero(), T::one());
    let order = order(voltage);
    let parts = [[one, zero], [zero, one]].map(|of_legs| phases(of_legs, order).clarke().dot(direction));
    (parts[0] * parts[0] + parts[1] * parts[1]) / T::of(2.0)
}

#[cfg(test)]
mod tests;
