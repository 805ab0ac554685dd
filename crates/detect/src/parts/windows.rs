//! Pulse-width modulation that one shunt in the DC link can sample.
//!
//! ```text
//!   first half of a period:  all low ─► [one leg high] ─► [two legs high] ─► all high
//!                                        its current       minus that of the leg that is low
//! ```
//! Within half a carrier period the legs rise one after the other, and between two rises the shunt shows the current of one leg. Small
//! voltages rise nearly at once: then the first leg's edges are shifted to be earlier and the last one's to be later, by as much in both
//! halves of the period. Each leg is high as long as before, so the mean voltage of each period is as ordered.
//!
//! Within the period the shifted edges and the ripple move the current at the two samples. In the next period the same voltage is given
//! backwards in time, with windows in its second half: with the charge of voltage `q(t) = ∫ u dt'` of the first period a sample at t has
//! `i(0) + Γ q(t)`, its mirror image in the second one `i(0) + Γ (2 q(T) − q(t))`, and the mean of both is `i(0) + Γ q(T)`: the current in
//! the middle of the pair, whatever Γ, the motor's saliency in it, and whatever the shift. What is left is the drop R·i of the ripple.

use standstill_interface::{
    Abc, AlphaBeta, Command, Fault, Leg, Nanos, Phase, Reading, Real, Sampling, Stage,
};

use crate::nameplate::{Nameplate, Place};
use crate::parts::modulation::ModulationSettings;
use crate::parts::settle::{link, link_current};
use crate::settings::{SettingsError, require};

/// By how much a sample may jitter within its window.
const MARGIN: Nanos = Nanos(400);

/// Settings of the windows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindowSettings<T> {
    /// How long each of the two vectors between rises lasts at least.
    pub length: Nanos,
    /// From the first conversion of a sample to its last: samples lie in the middle of a window, mirrored or not.
    pub averaged: Nanos,
    /// The shortest window in which the amplifier settles and a sample is converted.
    pub shortest: Nanos,
    /// Nominal voltage of the link in V, by which there is room or not.
    pub dc_link: T,
}

impl<T: Real> WindowSettings<T> {
    /// Windows of a drive with one shunt in its DC link; none for other drives.
    pub(crate) fn suited(drive: &Nameplate<T>) -> Option<Self> {
        let sensing = &drive.sensing;
        let settled = Nanos::from_seconds(sensing.blank().to_double()).max(drive.dead_time) + MARGIN;
        // Mirrored, what follows a sample precedes it.
        let length = settled * 2 + sensing.averaged;
        (sensing.place == Place::InLink).then_some(Self {
            length,
            averaged: sensing.averaged,
            shortest: length,
            dc_link: drive.dc_link,
        })
    }

    /// Whether half a carrier period has room for both windows about the leg in the middle, whatever the direction of `voltage` in V.
    pub(crate) fn check(&self, pwm: &ModulationSettings<T>, voltage: T) -> Result<(), SettingsError> {
        require(
            self.length >= self.shortest,
            "window",
            "at least twice the dead time and `sensors.settle`, and the conversions of a sample: it lies in the middle, mirrored or not",
        )?;
        let lost = pwm.lost(self.dc_link);
        // The leg in the middle has at most half of the voltage; an edge moves by as much as both may lose by dead time and drops.
        let half = T::of(0.5);
        let share = voltage / self.dc_link;
        let beside = half - half * share - T::of(2.0) * lost;
        let room = T::of(pwm.carrier_period.seconds()) * half * beside;
        require(
            T::of(self.length.seconds()) <= room && share + T::of(2.0) * lost < half,
            "window",
            "short enough for both windows beside the leg in the middle: a lower `inverter.carrier`, `detector.voltage` or `sensors.settle` makes room",
        )
    }

    /// A carrier period of this voltage in V in which both windows are long enough, in the first half of the period or, mirrored, in the
    /// second; currents as for [`ModulationSettings::command`].
    ///
    /// Dead time is made good at each edge: what delays the rise of a leg whose current is positive does not delay its fall, so a mean over
    /// both would leave the two periods unlike.
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
        // Of a period, in shares of half of it.
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

/// A leg that is high for `time` of half a period, next to its middle.
fn high<T>(time: Nanos, half: Nanos, second: bool) -> Leg<T> {
    match time {
        Nanos::ZERO => Leg::Low,
        time if time >= half => Leg::High,
        time if second => Leg::Fall(time),
        time => Leg::Rise(half - time),
    }
}

/// The phases in the order in which they rise for a voltage in V.
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

/// The currents in A of the first and the last leg from the readings of a period; `offset`: what the shunt reads without current.
pub(crate) fn seen<T: Real>(
    readings: &[Reading<T>],
    mirrored: bool,
    offset: T,
) -> Result<([T; 2], T), Fault<T>> {
    let [first, second] = readings else { return Err(Fault::UnexpectedReadings) };
    let (high, low) = if mirrored { (second, first) } else { (first, second) };
    // Of the leg that is alone high, and of the one that is alone low.
    let currents = [link_current(high)? - offset, offset - link_current(low)?];
    link(first)?;
    Ok((currents, link(second)?))
}

/// Phase currents in A from those of the first and the last leg.
pub(crate) fn phases<T: Real>([first, last]: [T; 2], order: [Phase; 3]) -> Abc<T> {
    let mut currents = Abc([T::zero(); 3]);
    currents[order[0]] = first;
    currents[order[1]] = -(first + last);
    currents[order[2]] = last;
    currents
}

#[cfg(test)]
mod tests {
    use super::*;

    const PWM: ModulationSettings<f64> = ModulationSettings {
        carrier_period: Nanos::from_micros(100),
        dead_time: Nanos::ZERO,
        drop: 0.0,
        inductance: 10e-3,
        fade: 1e-6,
    };

    const WINDOWS: WindowSettings<f64> = WindowSettings {
        length: Nanos::from_micros(8),
        averaged: Nanos::from_micros(1),
        shortest: Nanos::from_micros(8),
        dc_link: 500.0,
    };

    /// Whether a leg is high at a time of a command of two stages.
    fn is_high(command: &Command<f64>, phase: Phase, time: Nanos) -> bool {
        let first = command.stage;
        let (leg, time) = if time < first.duration {
            (first.legs[phase], time)
        } else {
            (command.then.expect("two halves").legs[phase], time - first.duration)
        };
        match leg {
            Leg::High => true,
            Leg::Low => false,
            Leg::Rise(at) => time >= at,
            Leg::Fall(at) => time < at,
            other => panic!("{other:?}"),
        }
    }

    /// Integral in V s of the voltage vector from the begin of a command to a time in it, in steps of a nanosecond.
    fn charge(command: &Command<f64>, until: Nanos) -> AlphaBeta<f64> {
        let on = Phase::ALL.map(|phase| {
            (0..until.0).filter(|time| is_high(command, phase, Nanos(*time))).count() as f64
                * 1e-9
                * WINDOWS.dc_link
        });
        Abc(on).clarke()
    }

    fn period(voltage: AlphaBeta<f64>, mirrored: bool) -> Command<f64> {
        WINDOWS.period(&PWM, voltage, WINDOWS.dc_link, [Abc([0.0; 3]); 2], mirrored)
    }

    /// The last conversions of samples.
    fn later(sampling: Sampling) -> Sampling {
        Sampling { first: sampling.first + WINDOWS.averaged, ..sampling }
    }

    fn directions() -> impl Iterator<Item = AlphaBeta<f64>> {
        (0..12).map(|n| (f64::from(n) * 0.53).sin_cos()).flat_map(|(sin, cos)| {
            [0.0, 0.5, 30.0, 70.0].map(|volts| AlphaBeta::new(cos * volts, sin * volts))
        })
    }

    #[test]
    fn law_each_sample_lies_in_a_vector_of_one_leg_that_has_settled() {
        for voltage in directions() {
            let order = order(voltage);
            for mirrored in [false, true] {
                let command = period(voltage, mirrored);
                assert_eq!(command.duration(), PWM.carrier_period);
                let mut samples = [0, 1].map(|n| command.sampling.trigger(n));
                if mirrored {
                    samples.reverse();
                }
                for (sample, alone, high) in [(samples[0], order[0], true), (samples[1], order[2], false)] {
                    // From the last edge on by which the amplifier settles, to the end of the window: 3.5 us, 1 us of conversions, 3.5 us.
                    for time in (sample.0 - 3_500..sample.0 + 4_500).map(Nanos) {
                        for phase in Phase::ALL {
                            let wanted = (phase == alone) == high;
                            assert_eq!(
                                is_high(&command, phase, time),
                                wanted,
                                "{voltage:?} {mirrored} {phase:?} {time:?}"
                            );
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn analytic_the_mean_voltage_is_as_ordered_and_mirrored_samples_show_the_middle() {
        // Γ in 1/H of a salient motor that is turned by 25°, without resistance.
        let (sin, cos) = 50_f64.to_radians().sin_cos();
        let gamma = |of: AlphaBeta<f64>| {
            let (mean, change) = (80.0, 20.0);
            AlphaBeta::new(
                (mean + change * cos) * of.alpha + change * sin * of.beta,
                change * sin * of.alpha + (mean - change * cos) * of.beta,
            )
        };
        let begin = AlphaBeta::new(0.7, -0.4);
        let mut ripple = 0.0_f64;
        for voltage in directions() {
            let order = order(voltage);
            let [first, second] = [false, true].map(|mirrored| period(voltage, mirrored));
            let whole = charge(&first, PWM.carrier_period);
            // A leg's time is in whole nanoseconds, of both halves.
            let ordered = voltage * PWM.carrier_period.seconds();
            assert!((whole - ordered).norm() < 2e-9 * WINDOWS.dc_link, "{voltage:?}: {whole:?}");
            assert!((charge(&second, PWM.carrier_period) - whole).norm() < 1e-12);
            let middle = begin + gamma(whole);
            let at = |command: &Command<f64>, begin: AlphaBeta<f64>| {
                [0, 1].map(|n| (begin + gamma(charge(command, command.sampling.trigger(n)))).phases())
            };
            // A conversion at the trigger, or in the mirrored period at the end of its span.
            let second = Command { sampling: later(second.sampling), ..second };
            let [one, two] = [at(&first, begin), at(&second, middle)];
            let found = phases(
                [(one[0][order[0]] + two[1][order[0]]) / 2.0, (one[1][order[2]] + two[0][order[2]]) / 2.0],
                order,
            );
            ripple = ripple.max((one[0][order[0]] - middle.phases()[order[0]]).abs());
            assert!(
                (found.clarke() - middle).norm() < 2e-9 * WINDOWS.dc_link * 100.0,
                "{voltage:?}: {found:?} {middle:?}"
            );
        }
        // By one sample alone it would be off by the ripple.
        assert!(ripple > 0.1, "{ripple} A");
    }

    #[test]
    fn law_without_room_the_key_is_named() {
        assert!(WINDOWS.check(&PWM, 60.0).is_ok());
        // 50 us, of which the leg in the middle leaves a share of 0.5 - 30/500: 22 us.
        let [fits, not] =
            [21, 23].map(|micros| WindowSettings { length: Nanos::from_micros(micros), ..WINDOWS });
        assert!(fits.check(&PWM, 60.0).is_ok());
        assert_eq!(not.check(&PWM, 60.0).map_err(|error| error.setting), Err("window"));
        let short = WindowSettings { length: Nanos::from_micros(7), ..WINDOWS };
        let refused = short.check(&PWM, 60.0).expect_err("no time to settle");
        assert!(refused.setting == "window" && refused.needed.contains("sensors.settle"));
        assert!(WINDOWS.check(&PWM, 260.0).is_err());
    }
}
