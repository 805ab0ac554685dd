//! Sampling: converts physical values to the drive's readings.

use standstill_interface::{Abc, Capture, Nanos, Reading, Sensed};
use standstill_inverter::Gate;
use standstill_numeric::{Compute, Wide};

use super::dividers::Dividers;
use super::misread::Misread;
use super::oversampling::Mean;
use super::{Arrangement, Channels, Converted, Sensors};
use crate::{Draws, Faults, Purpose, Streams};

/// The sampler of one run. It stores the physical values at each sample, and converts the stored values together when the drive asks for
/// its readings.
#[derive(Clone, Debug)]
pub struct Sampler<'t> {
    arrangement: Arrangement,
    /// Largest jitter of a trigger, and delay of all triggers, both in ns.
    late: [u64; 2],
    /// Whether the phases' channels have noise, and whether the link's channel has noise.
    noisy: [bool; 2],
    channels: Channels<4>,
    noise: Draws<'t>,
    link_noise: Draws<'t>,
    jitter: Draws<'t>,
    dividers: Option<Dividers<'t>>,
    misread: Option<Misread>,
    mean: Mean,
    /// Samples that have been taken since the last conversion.
    taken: Vec<Instant>,
    /// Whether all samples of the run are plain: each reads only the unfiltered currents and the link's voltage, and only samples, gate
    /// edges, ends of modes and ends of commands interrupt the run. The run sets this field from `Control::has_plain_samples`.
    pub is_plain: bool,
}

/// Physical values at the instant of a sample.
#[derive(Clone, Copy, Debug)]
pub struct Instant {
    /// Nominal time of the trigger, counted from the start of the command.
    pub at: Nanos,
    /// Time in ns since the start of the run.
    pub time: f64,
    /// Currents in A through the sensors, as [`super::SensorSettings::seen`] defines them. If the sensors have filters, the currents are
    /// the filters' outputs.
    pub current: [f64; 3],
    /// Voltage of the DC link in V. If the link's sensor has a filter, it is the filter's output.
    pub dc_link: f64,
    /// Voltages of the terminals in V. If the dividers have filters, they are the filters' outputs. Not used if the drive does not read
    /// its terminals.
    pub terminal: [f64; 3],
    /// Request to each leg immediately before the trigger's nominal time.
    pub requested: [Gate; 3],
    /// Whether the drive assumes, for each leg, that the amplifier of the leg's shunt has settled by the trigger's nominal time.
    pub settled: [bool; 3],
    /// The trip of a comparator in this command up to the sample. None if no comparator has tripped.
    pub capture: Option<Capture>,
}

impl Instant {
    /// Makes an instant for a drive without shunts, dividers and comparators. `at` is the trigger's nominal time in the command. `time`
    /// is the time in ns since the start of the run. `current` is in A and `dc_link` in V.
    #[inline(always)]
    pub fn new(at: Nanos, time: f64, current: [f64; 3], dc_link: f64) -> Self {
        Self {
            at,
            time,
            current,
            dc_link,
            terminal: [0.0; 3],
            requested: [Gate::Off; 3],
            settled: [true; 3],
            capture: None,
        }
    }
}

impl<'t> Sampler<'t> {
    /// Makes the sampler of a run. `taken` is allocated memory for samples. It is reused, and its contents are dropped.
    pub fn new(sensors: &Sensors, faults: Faults, streams: Streams<'t>, mut taken: Vec<Instant>) -> Self {
        taken.clear();
        taken.reserve(MOST_TAKEN);
        let [noise, link_noise, jitter] =
            streams.open_together([Purpose::CurrentNoise, Purpose::LinkNoise, Purpose::Jitter]);
        let dividers = Dividers::new(sensors, streams);
        let settings = &sensors.settings;
        Self {
            arrangement: settings.arrangement,
            late: [settings.jitter.0, settings.sample_delay.0],
            noisy: [settings.noise > 0.0, settings.dc_link.noise > 0.0],
            channels: Channels::of(sensors),
            noise,
            link_noise,
            jitter,
            dividers,
            misread: Misread::of(faults),
            mean: Mean::of(settings.oversampling),
            taken,
            is_plain: false,
        }
    }

    /// Drops those samples of the finished command that have not been converted.
    pub fn clear(&mut self) {
        self.taken.clear();
        self.mean.clear();
    }

    /// Returns the allocated memory for samples, so that the next run can reuse it.
    pub fn into_room(self) -> Vec<Instant> {
        self.taken
    }

    /// Returns the actual sampling time of a trigger with the time `nominal`. It includes delay and jitter, and is limited to the
    /// trigger's command.
    pub fn instant(&mut self, nominal: Nanos, command_start: Nanos, command_end: Nanos) -> Nanos {
        let [jitter, delay] = self.late;
        let late = nominal.0 + delay;
        let moved =
            if jitter == 0 { late } else { (late + self.jitter.integer(2 * jitter)).saturating_sub(jitter) };
        Nanos(moved.max(command_start.0).min(command_end.0))
    }

    /// Stores the physical values of a sample. Returns whether the store is full; then the samples should be converted.
    #[inline(always)]
    pub fn take(&mut self, there: Instant) -> bool {
        self.taken.push(there);
        self.taken.len() >= MOST_TAKEN
    }

    /// Returns the time in ns of the last sample that has not been converted. Zero if there is no such sample.
    pub fn last_taken(&self) -> f64 {
        self.taken.last().map_or(0.0, |there| there.time)
    }

    /// Converts the samples that have been taken since the last call, and appends their readings to `readings`.
    pub fn convert<V: Wide>(&mut self, readings: &mut Vec<Reading<f64>>) {
        if !self.taken.is_empty() {
            let taken = std::mem::take(&mut self.taken);
            let known = readings.len();
            readings.reserve(taken.len());
            for taken in taken.chunks(AT_ONCE) {
                V::compute(Conversion { sampler: self, taken, readings });
            }
            self.mean.replace(readings, known);
            self.taken = taken;
            self.taken.clear();
        }
    }

    /// Converts the physical values `there` of a sample into `reading`. `noise` contains standard normals for the channels.
    #[inline(always)]
    fn read(&mut self, there: &Instant, noise: [f64; 4], reading: &mut Reading<f64>) {
        let [a, b, c] = there.current;
        let values = [a, b, c, there.dc_link];
        let raw = match &mut self.misread {
            None => self.channels.read(values, noise),
            Some(misread) => misread.read(&self.channels, values, noise, there.time),
        };
        let [a, b, c, link] = raw.value;
        (reading.at, reading.current, reading.dc_link) = (there.at, Abc([a, b, c]), link);
        let [a, b, c, link] = raw.at_end;
        (reading.sensed, reading.dc_link_clipped) = (Abc([of_end(a), of_end(b), of_end(c)]), link);
        let [a, b, c, link] = raw.code;
        (reading.counts.current, reading.counts.dc_link) = (Abc([a, b, c]), link);
        reading.capture = there.capture;
        if self.arrangement != Arrangement::ThreeInLine {
            self.see(there, &raw, reading);
        }
        if let Some(dividers) = &mut self.dividers {
            let terminals = dividers.read(there.terminal, self.misread.as_ref(), there.time);
            reading.terminal = Abc(terminals.map(|(value, ..)| value));
            reading.terminal_sensed = Abc(terminals.map(|(_, sensed, _)| sensed));
            reading.counts.terminal = Abc(terminals.map(|(.., code)| code));
        }
    }

    /// Writes the currents into a reading, for drives that do not have a sensor in each of the three phases.
    #[inline(never)]
    fn see(&self, there: &Instant, raw: &Converted<4>, reading: &mut Reading<f64>) {
        let measured = |k: usize| (raw.value[k], of_end(raw.at_end[k]), raw.code[k]);
        let mut link_current = HIDDEN;
        if self.arrangement == Arrangement::DcLinkShunt && there.settled == [true; 3] {
            link_current = measured(0);
            reading.link_current = link_current.0;
            reading.link_sensed = link_current.1;
            reading.counts.link_current = link_current.2;
        }
        let phases = self.phases(there, measured, link_current);
        reading.current = Abc(phases.map(|(value, ..)| value));
        reading.sensed = Abc(phases.map(|(_, sensed, _)| sensed));
        reading.counts.current = Abc(phases.map(|(.., code)| code));
    }

    /// Returns the phase currents that a drive with this arrangement of sensors knows. `measured` returns the reading of a channel.
    /// `link` is the reading of the shunt in the DC link.
    fn phases(&self, there: &Instant, measured: impl Fn(usize) -> Shown, link: Shown) -> [Shown; 3] {
        let derived = |k: usize| {
            let (x, y) = (measured((k + 1) % 3), measured((k + 2) % 3));
            let clipped = x.1 == Sensed::Clipped || y.1 == Sensed::Clipped;
            (-(x.0 + y.0), if clipped { Sensed::Clipped } else { Sensed::Derived }, 0)
        };
        let shown = |k: usize| there.requested[k] != Gate::High && there.settled[k];
        match self.arrangement {
            Arrangement::None => [HIDDEN; 3],
            Arrangement::ThreeInLine => [measured(0), measured(1), measured(2)],
            Arrangement::TwoInLine => [measured(0), measured(1), derived(2)],
            Arrangement::LowSideShunts => {
                [0, 1, 2].map(|k| match (shown(k), shown((k + 1) % 3), shown((k + 2) % 3)) {
                    (true, ..) => measured(k),
                    (false, true, true) => derived(k),
                    _ => HIDDEN,
                })
            }
            Arrangement::DcLinkShunt => {
                // The diodes of a leg whose gates are off may carry an unknown part of the link's current.
                let active = !there.requested.contains(&Gate::Off);
                let alone = |gate, k: usize| {
                    active
                        && there.requested[k] == gate
                        && there.requested.iter().filter(|of| **of == gate).count() == 1
                };
                [0, 1, 2].map(|k| match link {
                    (_, Sensed::Hidden, _) => HIDDEN,
                    of if alone(Gate::High, k) => of,
                    (value, sensed, code) if alone(Gate::Low, k) => (-value, sensed, code),
                    _ => HIDDEN,
                })
            }
        }
    }
}

/// Number of samples whose noise is drawn together.
const AT_ONCE: usize = 8;

/// Number of samples that are stored before they are converted. It limits the memory, because a command may ask for a million samples.
const MOST_TAKEN: usize = 64;

/// The conversion of at most [`AT_ONCE`] samples. The channels of each sample are computed side by side.
struct Conversion<'s, 't> {
    sampler: &'s mut Sampler<'t>,
    taken: &'s [Instant],
    readings: &'s mut Vec<Reading<f64>>,
}

impl Compute for Conversion<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn compute(self) {
        let Self { sampler, taken, readings } = self;
        let (mut noise, mut link_noise) = ([0.0; 3 * AT_ONCE], [0.0; AT_ONCE]);
        let [phases_are_noisy, link_is_noisy] = sampler.noisy;
        if phases_are_noisy {
            sampler.noise.normals(&mut noise[..3 * taken.len()]);
        }
        if link_is_noisy {
            sampler.link_noise.normals(&mut link_noise[..taken.len()]);
        }
        let (noise, _) = noise.as_chunks::<3>();
        let noise = noise.iter().zip(&link_noise);
        let blank = Reading::measured(Nanos::ZERO, [0.0; 3], 0.0);
        for (there, ([a, b, c], link)) in taken.iter().zip(noise) {
            readings.push(blank);
            let Some(reading) = readings.last_mut() else { return };
            sampler.read(there, [*a, *b, *c, *link], reading);
        }
    }
}

/// Returns the status of a measured value. `at_end` says whether its code is at an end of the converter's range.
#[inline(always)]
fn of_end(at_end: bool) -> Sensed {
    if at_end { Sensed::Clipped } else { Sensed::Measured }
}

/// A current in A that the drive reads, with its status (measured, derived, clipped or hidden) and its converter's code.
type Shown = (f64, Sensed, u32);

/// A current that the drive cannot read.
const HIDDEN: Shown = (0.0, Sensed::Hidden, 0);

#[cfg(test)]
mod tests;
