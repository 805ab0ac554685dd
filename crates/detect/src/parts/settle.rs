//! Waiting until the current is gone.

#[cfg(test)]
mod tests;

use standstill_interface::{Abc, Command, Fault, Leg, Nanos, Phase, Reading, Real, Sampling, Sensed, Stage};

use crate::nameplate::{Nameplate, Place};
use crate::parts::margin::Margin;
use crate::settings::{LONGEST, SettingsError, require, require_positive};

/// Settings of the waits for the decay of the last pulse's current: wait, read, and wait again.
///
/// With slow decay the waits are zero vectors until the current is below the threshold, and then one with all gates
/// off, in which the remaining current returns to the link within microseconds. With fast decay all gates are off from
/// the beginning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettleSettings<T> {
    /// Length of one wait. The current is sampled at four fifths of it and at its end.
    pub wait: Nanos,
    /// Phase current in A below which the current counts as decayed: above the sensors' offset and noise, but small
    /// enough not to disturb the next pulse.
    pub threshold: T,
    /// Number of waits before the detection fails.
    pub attempts: u16,
    /// Arrangement of the current sensors. The current of a single shunt in the DC link is used instead of the phases'.
    pub place: Place,
}

impl<T: Real> SettleSettings<T> {
    /// Returns settings with waits of `micros` µs, until 2.5 % of the rated current are left.
    pub(crate) fn suited(drive: &Nameplate<T>, micros: u64, attempts: u16) -> Self {
        let threshold = drive.rated_current * T::of(0.025);
        Self { wait: Nanos::from_micros(micros), threshold, attempts, place: drive.sensing.place }
    }

    pub(crate) fn check(&self) -> Result<(), SettingsError> {
        require(self.wait.0 >= 5 && self.wait <= LONGEST, "settle.wait", "from 5 ns to a minute")?;
        require_positive(self.threshold, "settle.threshold")?;
        require(self.attempts > 0, "settle.attempts", "at least 1")
    }

    /// Returns the command of one wait, with the zero vector or (`released`) with all gates off.
    fn command(&self, released: bool) -> Command<T> {
        let leg = if released { Leg::Off } else { Leg::Low };
        let early = Nanos(self.wait.0 / 5 * 4);
        let stage = Stage { legs: Abc::new(leg, leg, leg), duration: self.wait };
        Command::hold(stage, Sampling::twice(early, self.wait))
    }

    /// Evaluates a wait: returns the residual currents and the largest of them, in A. The reading of a shunt in the DC
    /// link stands for each phase.
    fn judge(&self, readings: &[Reading<T>]) -> Result<(Abc<T>, T), Fault<T>> {
        let [_, last] = readings else { return Err(Fault::UnexpectedReadings) };
        if self.place == Place::InLink {
            let mut most = T::zero();
            for reading in readings {
                most = most.max(link_current(reading)?.abs());
                link(reading)?;
            }
            return Ok((Abc([last.link_current; 3]), most));
        }
        // A current that no sensor sees has no known offset.
        let residual = Abc(core::array::from_fn(|k| match last.sensed.0[k] {
            Sensed::Hidden => T::zero(),
            _ => last.current.0[k],
        }));
        let mut most = T::zero();
        for reading in readings {
            most = most.max(largest(reading)?);
            link(reading)?;
        }
        Ok((residual, most))
    }
}

/// Largest magnitude, in A or V, that counts as a reading of a sensor; its square still keeps its digits in sums.
const MOST: f64 = 1e9;

/// Returns whether a sensor can have read this number.
#[inline]
pub(crate) fn is_reading<T: Real>(value: T) -> bool {
    value.abs() <= T::of(MOST)
}

/// Returns the largest phase current in A among those that a sensor saw.
pub(crate) fn largest<T: Real>(reading: &Reading<T>) -> Result<T, Fault<T>> {
    largest_beyond(reading, &Abc([T::zero(); 3]))
}

/// Returns the largest phase current in A among those that a sensor saw, less offsets in A.
pub(crate) fn largest_beyond<T: Real>(reading: &Reading<T>, offset: &Abc<T>) -> Result<T, Fault<T>> {
    let mut largest = T::zero();
    for phase in Phase::ALL {
        if reading.sensed[phase] == Sensed::Hidden {
            continue;
        }
        let current = reading.current[phase] - offset[phase];
        if !is_reading(current) {
            return Err(Fault::NotANumber);
        }
        largest = largest.max(current.abs());
    }
    Ok(largest)
}

/// Returns the DC-link voltage in V of a reading. Fails if it cannot be used.
pub(crate) fn link<T: Real>(reading: &Reading<T>) -> Result<T, Fault<T>> {
    if reading.dc_link_clipped {
        Err(Fault::DcLinkClipped)
    } else if is_reading(reading.dc_link) && reading.dc_link > T::zero() {
        Ok(reading.dc_link)
    } else {
        Err(Fault::NotANumber)
    }
}

/// Returns a phase current in A. Fails if no sensor saw it.
#[inline]
pub(crate) fn seen<T: Real>(reading: &Reading<T>, phase: Phase) -> Result<T, Fault<T>> {
    match reading.sensed[phase] {
        Sensed::Clipped => Err(Fault::Clipped(phase)),
        Sensed::Hidden => Err(Fault::Hidden(phase)),
        Sensed::Measured | Sensed::Derived if !is_reading(reading.current[phase]) => Err(Fault::NotANumber),
        Sensed::Measured | Sensed::Derived => Ok(reading.current[phase]),
    }
}

/// Returns the current in A through the shunt in the DC link. Fails if it was not seen.
pub(crate) fn link_current<T: Real>(reading: &Reading<T>) -> Result<T, Fault<T>> {
    match reading.link_sensed {
        Sensed::Clipped => Err(Fault::LinkCurrentClipped),
        Sensed::Hidden => Err(Fault::LinkCurrentHidden),
        Sensed::Measured | Sensed::Derived if !is_reading(reading.link_current) => Err(Fault::NotANumber),
        Sensed::Measured | Sensed::Derived => Ok(reading.link_current),
    }
}

/// Returns all three phase currents in A. Fails if a sensor did not see one.
#[inline]
pub(crate) fn all_seen<T: Real>(reading: &Reading<T>) -> Result<Abc<T>, Fault<T>> {
    Ok(Abc::new(seen(reading, Phase::A)?, seen(reading, Phase::B)?, seen(reading, Phase::C)?))
}

/// Waits for currents to decay, and learns from each wait the sensors' readings without current.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settler<T> {
    settings: SettleSettings<T>,
    /// Whether all gates are off from the beginning.
    fast: bool,
    waits: u16,
    released: bool,
    /// The last currents in A of the last wait: offsets plus the remaining current.
    pub residual: Abc<T>,
    /// Sum of `residual` in A over the waits, and their number.
    residuals: (Abc<T>, T),
    /// DC link in V at the end of the last wait.
    pub dc_link: T,
    /// Noise of the sensors.
    pub noise: Noise<T>,
    /// Margin to a fault; the method adds the margins of its own checks.
    pub margin: Margin<T>,
    /// End of the last command of the measurement, from the start of the detection.
    pub clock: Nanos,
}

impl<T: Real> Settler<T> {
    pub fn new(settings: SettleSettings<T>, fast: bool) -> Self {
        let zero = T::zero();
        Self {
            settings,
            fast,
            waits: 0,
            released: fast,
            residual: Abc::new(zero, zero, zero),
            residuals: (Abc::new(zero, zero, zero), zero),
            dc_link: zero,
            noise: Noise::new(),
            margin: Margin::new(),
            clock: Nanos::ZERO,
        }
    }

    /// Returns the mean in A of the sensors' readings without current at the ends of the waits, and the number of
    /// waits.
    pub fn offset(&self) -> (Abc<T>, T) {
        let (sum, waits) = self.residuals;
        (sum.map(|sum| sum / waits.max(T::one())), waits)
    }

    /// Begins to wait.
    pub fn begin(&mut self) -> Command<T> {
        self.wait(1, self.fast)
    }

    fn wait(&mut self, waits: u16, released: bool) -> Command<T> {
        (self.waits, self.released) = (waits, released);
        self.settings.command(released)
    }

    /// Evaluates a wait: returns another wait, or none once the current has decayed.
    pub fn step(&mut self, readings: &[Reading<T>]) -> Result<Option<Command<T>>, Fault<T>> {
        let s = self.settings;
        let (residual, most) = s.judge(readings)?;
        let (gone, last) = (most <= s.threshold, self.waits >= s.attempts);
        if gone || last {
            self.margin.waited(self.waits, s.attempts, most / s.threshold);
            // With all gates off no current is left: what a reading shows is an offset, which no further wait takes away.
            if self.released {
                self.margin.at_most(most, s.threshold);
            }
        }
        match (gone, self.released) {
            (true, true) => {
                self.residual = residual;
                let (sum, waits) = self.residuals;
                self.residuals = (Abc(core::array::from_fn(|k| sum.0[k] + residual.0[k])), waits + T::one());
                self.dc_link = readings.last().map_or(self.dc_link, |reading| reading.dc_link);
                self.noise.add(readings, s.place);
                Ok(None)
            }
            (true, false) => Ok(Some(self.wait(1, true))),
            (false, _) if last => Err(Fault::CurrentPersists(most)),
            (false, _) => Ok(Some(self.wait(self.waits + 1, self.released))),
        }
    }
}

/// The noise of the current sensors, learnt from readings while no current flows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Noise<T> {
    squares: T,
    pairs: T,
    /// Sum of squares for the DC link, relative to its voltage.
    link_squares: T,
    links: T,
}

impl<T: Real> Noise<T> {
    fn new() -> Self {
        let zero = T::zero();
        Self { squares: zero, pairs: zero, link_squares: zero, links: zero }
    }

    /// Adds two readings of the same currents; their differences are noise alone, whatever the offsets.
    fn add(&mut self, readings: &[Reading<T>], place: Place) {
        let [first, second] = readings else { return };
        let link = (second.dc_link - first.dc_link) / second.dc_link;
        self.link_squares = self.link_squares + link * link;
        self.links = self.links + T::one();
        if place == Place::InLink {
            let difference = second.link_current - first.link_current;
            self.squares = self.squares + difference * difference;
            self.pairs = self.pairs + T::one();
            return;
        }
        for phase in Phase::ALL {
            if first.sensed[phase] == Sensed::Hidden || second.sensed[phase] == Sensed::Hidden {
                continue;
            }
            let difference = second.current[phase] - first.current[phase];
            self.squares = self.squares + difference * difference;
            self.pairs = self.pairs + T::one();
        }
    }

    /// Returns the standard deviation of one reading in A.
    pub fn deviation(&self) -> T {
        (self.squares / (self.pairs + self.pairs).max(T::one())).sqrt()
    }

    /// Returns the degrees of freedom of [`Self::deviation`].
    pub fn freedom(&self) -> T {
        self.pairs
    }

    /// Returns the relative variance of one reading of the DC link, and its degrees of freedom. Ripple counts as noise.
    pub fn of_link(&self) -> (T, T) {
        (self.link_squares / (self.links + self.links).max(T::one()), self.links)
    }
}
