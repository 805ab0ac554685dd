//! DC alignment: the current turns the rotor to a known direction instead of finding its position.
//!
//! ```text
//!   current along 90°: ramp, hold ─► wait ─► current along 0°: ramp, hold ─► wait ─► the rotor stands at 0°
//!                                           └ did the magnet sweep across? ┘
//! ```
//! Two directions are used, because a rotor that is opposite to the first feels no torque. A locked rotor would also be
//! given an angle, so its motion is checked. A magnet that turns from 90° to 0° sweeps its flux ψ across the β axis,
//! and if the voltage there is a small constant u, `∫ (R i_β − u) dt = ψ_β(start) − ψ_β(end)`. The voltage u is what
//! the compensation of unequal legs leaves; it follows from the steady current at the end. If the flux swept is far
//! from ψ, the rotor did not follow, and the method gives no angle. A rotor that something else turns does not stand
//! still at the end either: its magnet induces a current that turns with it, while a rotor at standstill leaves a
//! constant current.

#[cfg(test)]
mod tests;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Dq, Fault, Findings, Nanos, Outcome, Reading, Real, Sensed, Step,
};

use crate::checks::{Check, Checks};
use crate::keys::{Keyed, Setting, place};
use crate::method::Sequence;
use crate::nameplate::Nameplate;
use crate::parts::margin::Margin;
use crate::parts::modulation::ModulationSettings;
use crate::parts::settle::{SettleSettings, Settler, all_seen, link};
use crate::parts::turning;
use crate::settings::{
    LONGEST, SettingsError, require, require_positive, require_share, require_zero_or_more,
};

/// Largest variation of the held current while the rotor stands, as a share of that current.
const UNSTEADY: f64 = 0.005;

/// Settings of the alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AlignmentSettings<T> {
    /// PWM, with compensation of dead time and drops.
    pub modulation: ModulationSettings<T>,
    /// Current in A that turns the rotor.
    pub current: T,
    /// Resistance of a phase in Ω, with that of a device.
    pub resistance: T,
    /// Flux linkage of the magnet in Wb.
    pub magnet_flux: T,
    /// Least share of `magnet_flux` that must sweep across the winding.
    pub least_sweep: T,
    /// Checks that are on: whether the rotor stands still at the end.
    pub checks: Checks,
    /// Carrier periods from one command to the next.
    pub periods: u16,
    /// Commands over which the current grows.
    pub ramp: u16,
    /// Commands over which the current is then held.
    pub hold: u16,
    /// The wait after each direction.
    pub settle: SettleSettings<T>,
}

impl<T: Real> AlignmentSettings<T> {
    /// Returns settings for this motor and drive: the rated current, 0.2 s of ramp and 1 s of hold in each direction.
    ///
    /// ```
    /// # let nameplate = include!(concat!(env!("CARGO_MANIFEST_DIR"), "/doc/nameplate.rs"));
    /// use standstill_detect::{AlignmentSettings, Settings};
    ///
    /// // Alignment turns the rotor: where it stood before is not what it finds.
    /// let settings = AlignmentSettings::suited(&nameplate);
    /// assert!(settings.turns_rotor());
    /// assert_eq!(settings.carrier_period(), Some(nameplate.carrier_period));
    /// ```
    pub fn suited(drive: &Nameplate<T>) -> Self {
        // A millisecond, in whole periods.
        let periods = u16::try_from((1_000_000 / drive.carrier_period.0.max(1)).max(1)).unwrap_or(u16::MAX);
        Self {
            modulation: ModulationSettings::suited(drive),
            current: drive.rated_current,
            resistance: drive.resistance + (drive.switch_drop[1] + drive.reverse_drop[1]) / T::of(2.0),
            magnet_flux: drive.magnet_flux,
            least_sweep: T::of(0.6),
            checks: Checks::ALL,
            periods,
            ramp: 200,
            hold: 1000,
            settle: SettleSettings::suited(drive, 2000, 500),
        }
    }

    fn check(&self) -> Result<(), SettingsError> {
        self.modulation.check()?;
        require_positive(self.current, "current")?;
        require_positive(self.resistance, "resistance")?;
        require_zero_or_more(self.magnet_flux, "magnet_flux")?;
        require_share(self.least_sweep, "least_sweep")?;
        require(self.periods > 0, "periods", "at least 1")?;
        let command = self.modulation.carrier_period * u64::from(self.periods);
        require(command <= LONGEST, "periods", "such that a command lasts a minute at most")?;
        // Commands are counted in 16 bits.
        require((1..=30_000).contains(&self.ramp), "ramp", "from 1 to 30,000")?;
        require((1..=30_000).contains(&self.hold), "hold", "from 1 to 30,000")?;
        self.settle.check()
    }

    fn seconds(&self) -> T {
        T::of(self.modulation.carrier_period.seconds() * f64::from(self.periods))
    }
}

/// State of the sequence, named after the last command.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    Start,
    Settling { second: bool },
    Pulling { second: bool, command: u16 },
    Leaving,
}

/// The detector by alignment.
#[derive(Clone, Debug)]
pub struct Alignment<T> {
    settings: AlignmentSettings<T>,
    state: State,
    settler: Settler<T>,
    /// Last currents in A and link voltage in V, offsets removed.
    current: Abc<T>,
    dc_link: T,
    /// Current in A across the direction of the pull, at the last sample.
    across: T,
    /// Sum of that current over the commands of the second pull, in A; `steady`, the next field: the same sum over the
    /// last third of the hold.
    total: T,
    steady: T,
    /// Currents in A in the last third of the second hold: their number, their mean, and the sum of their squared
    /// deviations from the mean in A². `derived`, the next field: whether a current was not seen by a sensor of its
    /// own.
    held: (T, AlphaBeta<T>, T),
    derived: bool,
    findings: Findings<T>,
}

impl<T: Real> Alignment<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: AlignmentSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        Ok(Self {
            settings,
            state: State::Start,
            settler: Settler::new(settings.settle, true),
            current: Abc::new(zero, zero, zero),
            dc_link: zero,
            across: zero,
            total: zero,
            steady: zero,
            held: (zero, AlphaBeta::new(zero, zero), zero),
            derived: false,
            findings: Findings::default(),
        })
    }

    fn direction(second: bool) -> Angle<T> {
        if second { Angle::from_radians(T::zero()) } else { Angle::from_radians(T::FRAC_PI_2()) }
    }

    fn pull(&mut self, second: bool, command: u16) -> Command<T> {
        self.state = State::Pulling { second, command };
        let s = &self.settings;
        let share = (T::of(f64::from(command) + 1.0) / T::of(f64::from(s.ramp))).min(T::one());
        let vector = Dq::new(s.current * share * s.resistance, T::zero()).unpark(Self::direction(second));
        let wanted = Dq::new(s.current * share, T::zero()).unpark(Self::direction(second));
        // The sign of a leg's current is that of the last sample, or where that is small that of what is wanted.
        let wanted = wanted.phases();
        let small = s.modulation.fade;
        let mut expected = self.current;
        for (last, wanted) in expected.0.iter_mut().zip(wanted.0) {
            if last.abs() < small {
                *last = wanted;
            }
        }
        s.modulation.command(vector, self.dc_link, [expected; 2], s.periods)
    }

    /// Returns the number of commands in the last third of a hold, in which the rotor should stand still.
    fn late(&self) -> u16 {
        self.settings.hold.div_ceil(3)
    }

    fn pulled(&mut self, second: bool, command: u16, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let [reading] = readings else { return Err(Fault::UnexpectedReadings) };
        let seen = all_seen(reading)?;
        self.dc_link = link(reading)?;
        let residual = self.settler.residual;
        for k in 0..3 {
            self.current.0[k] = seen.0[k] - residual.0[k];
        }
        let AlphaBeta { alpha, beta } = self.current.clarke();
        let across = if second { beta } else { -alpha };
        if second {
            // Trapezoids between the samples.
            let mean = (self.across + across) / T::of(2.0);
            self.total = self.total + mean;
            if command >= self.settings.ramp + self.settings.hold - self.late() {
                self.steady = self.steady + mean;
                self.hold(AlphaBeta { alpha, beta });
                self.derived |= reading.sensed.0.contains(&Sensed::Derived);
            }
        }
        self.across = across;
        Ok(())
    }

    /// Checks, at the end of a pull, that the ordered current flows: in each phase that is to carry at least half of the current, at
    /// least a third of its share. The length of the current's vector does not show this: without phase c both pulls drive a current
    /// through a and b alone, along 150° and along −30°, so that a rotor which has followed the first feels no torque in the second.
    fn check_reached(&mut self, second: bool) -> Result<(), Fault<T>> {
        let ordered = Dq::new(self.settings.current, T::zero()).unpark(Self::direction(second)).phases();
        // Half of the current, less what rounding takes from it.
        let half = self.settings.current * T::of(0.499);
        for (flowing, ordered) in self.current.0.into_iter().zip(ordered.0) {
            if ordered.abs() >= half {
                let reached = if ordered < T::zero() { -flowing } else { flowing };
                let needed = ordered.abs() / T::of(3.0);
                self.settler.margin.at_least(reached, needed);
                if reached < needed {
                    return Err(Fault::NoCurrent { peak: reached, needed });
                }
            }
        }
        Ok(())
    }

    fn hold(&mut self, current: AlphaBeta<T>) {
        let (count, mean, squares) = self.held;
        let count = count + T::one();
        let apart = current - mean;
        let mean = mean + apart * count.recip();
        self.held = (count, mean, squares + apart.dot(current - mean));
    }

    /// Checks that the rotor stands still at the end: the held current must be constant except for noise. A speed
    /// changes it by at most `e/R`, so the reported speed is a lower bound.
    fn check_standing(&mut self) -> Result<(), Fault<T>> {
        let s = &self.settings;
        let (count, _, squares) = self.held;
        if !s.checks.has(Check::Turning) || s.magnet_flux <= T::zero() || count < T::of(2.0) {
            return Ok(());
        }
        let noise = self.settler.noise.deviation();
        let scattered = (squares / (count - T::one())).sqrt();
        let to_speed = s.resistance / s.magnet_flux;
        let allowed = turning::held(noise, self.derived, count) + s.current * T::of(UNSTEADY);
        turning::check_speed(&mut self.settler.margin, scattered * to_speed, allowed * to_speed, None)
    }

    /// Returns the first command of a pull, after the last current has decayed.
    fn begin(&mut self, second: bool) -> Command<T> {
        let zero = T::zero();
        self.dc_link = self.settler.dc_link;
        self.current = Abc::new(zero, zero, zero);
        self.across = zero;
        self.pull(second, 0)
    }

    fn answer(&mut self) -> Result<Step<T>, Fault<T>> {
        let s = &self.settings;
        let commands = T::of(f64::from(s.ramp) + f64::from(s.hold));
        let late = T::of(f64::from(self.late()));
        let seconds = s.seconds() * s.resistance;
        let swept = ((self.total - self.steady / late * commands) * seconds).abs();
        // Noise alone would show a flux: total − steady N/m has the variance σ² N (N − m)/m, and with two sensors the
        // current across the pull has up to 4/3 of a reading's noise.
        let noise = self.settler.noise.deviation() * T::of(4.0 / 3.0);
        let noise = noise * (commands * (commands - late) / late).sqrt() * seconds;
        let needed = (s.least_sweep * s.magnet_flux).max(T::of(5.0) * noise);
        let most = (T::of(2.0) - s.least_sweep) * s.magnet_flux;
        self.settler.margin.at_least(swept, needed);
        self.settler.margin.at_most(swept, most);
        if s.magnet_flux <= T::zero() || swept < needed || swept > most || !swept.is_finite() {
            return Err(Fault::DidNotFollow { swept, needed });
        }
        self.check_standing()?;
        let angle = Self::direction(true);
        // The current holds the rotor there at the end.
        self.findings.age = Some(T::zero());
        Ok(Step::Done(Outcome::Found { angle, findings: self.findings }))
    }
}

impl<T: Real> Sequence<T> for Alignment<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let command = match self.state {
            State::Start => {
                self.state = State::Settling { second: false };
                self.settler.begin()
            }
            State::Settling { second } => match self.settler.step(readings)? {
                Some(wait) => wait,
                None => self.begin(second),
            },
            State::Pulling { second, command } => {
                self.pulled(second, command, readings)?;
                if command + 1 < self.settings.ramp + self.settings.hold {
                    self.pull(second, command + 1)
                } else {
                    self.check_reached(second)?;
                    self.state = if second { State::Leaving } else { State::Settling { second: true } };
                    self.settler.begin()
                }
            }
            State::Leaving => match self.settler.step(readings)? {
                Some(wait) => wait,
                None => return self.answer(),
            },
        };
        Ok(Step::Drive(command))
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        (&self.findings, self.settler.margin)
    }
}

impl<T: Real> Keyed for AlignmentSettings<T> {
    const TURNS_ROTOR: bool = true;

    const SETTINGS: &'static [Setting<Self>] = &[
        place!(COMPENSATION, s => s.modulation => compensation, set_compensation),
        place!(CHECKS, s => s.checks => value, set_value),
    ];

    fn carrier(&self) -> Option<Nanos> {
        Some(self.modulation.carrier_period)
    }
}
