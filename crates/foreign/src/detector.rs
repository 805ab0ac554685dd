//! A foreign detector as the bench sees it.

use std::ffi::{CString, c_void};
use std::fmt;
use std::ptr::NonNull;
use std::sync::Arc;

use standstill_detect::{Nameplate, Signature};
use standstill_interface::{
    Angle, Command, Detector, Fault, Findings, Nanos, Outcome, Own, PoleEvidence, Reading, Step, Undetermined,
};

use crate::command;
use crate::fenced::Beyond;
use crate::guard::Guard;
use crate::image::{Image, Moment, Site};
use crate::interrupt::Interrupts;
use crate::library::{Level, Library};
use crate::log::Log;
use crate::texts::kept;
use crate::watched::Watched;
use standstill_interface::abi::{self, Answer, Drive, Sample};

/// Factory of the detectors of a scenario: the library, and all that `create` is passed besides seed and trial.
#[derive(Clone, Debug)]
pub struct Maker {
    library: Arc<Library>,
    drive: Drive,
    config: CString,
}

impl PartialEq for Maker {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.library, &other.library)
            && (self.drive, &self.config) == (other.drive, &other.config)
    }
}

/// A current or a voltage by its converter: its value is `at_zero` + code · `per_count`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scale {
    /// Resolution in bits.
    pub bits: u8,
    /// Current in A or voltage in V per count.
    pub per_count: f64,
    /// Value of the code zero, in A or V.
    pub at_zero: f64,
}

impl Maker {
    /// Makes the detectors of a library for a drive with this nameplate. `converters`: those of the currents, the DC
    /// link and the terminals, if any. `config`: lines of KEY=VALUE.
    pub fn new(
        library: Arc<Library>,
        knows: &Nameplate<f64>,
        converters: [Option<Scale>; 3],
        config: &str,
    ) -> Self {
        // What a firmware has in its own numbers.
        #[allow(clippy::cast_possible_truncation)]
        let short = |value: f64| value as f32;
        let [current, dc_link, terminal] = converters.map(Option::unwrap_or_default);
        let comparator = knows.sensing.comparator;
        #[allow(clippy::cast_possible_truncation, reason = "some hundred bytes")]
        let drive = Drive {
            size: size_of::<Drive>() as u32,
            current_bits: current.bits.into(),
            dc_link_bits: dc_link.bits.into(),
            amps_per_count: short(current.per_count),
            amps_at_zero: short(current.at_zero),
            volts_per_count: short(dc_link.per_count),
            dc_link: short(knows.dc_link),
            rated_current: short(knows.rated_current),
            resistance: short(knows.resistance),
            ld: short(knows.d_axis_inductance),
            lq: short(knows.q_axis_inductance),
            flux: short(knows.magnet_flux),
            dead_time: short(knows.dead_time.seconds()),
            stronger_pole: match knows.signature {
                Signature::Normal => 1,
                Signature::Inverted => -1,
                Signature::None => 0,
            },
            period_ns: knows.carrier_period.0,
            settle_ns: knows.sensing.settle.0,
            terminal_bits: terminal.bits.into(),
            terminal_volts_per_count: short(terminal.per_count),
            timer_tick: short(comparator.tick),
            comparator_delay: short(comparator.delay),
            comparator_offset: short(comparator.offset),
            comparator_noise: short(comparator.noise),
            comparators: match comparator {
                of if of.tick == 0.0 => 0,
                of if of.own => 6,
                _ => 1,
            },
            comparator_delay_spread: short(comparator.delay_spread),
            comparator_blanking: short(comparator.blanking),
            threshold_highest: short(comparator.highest),
            log_to: 0,
            log: 0,
        };
        // Lines come from a document, where a zero byte is refused; one that comes another way ends the text there.
        let config = CString::new(config.split('\0').next().unwrap_or_default()).unwrap_or_default();
        Self { library, drive, config }
    }

    /// Returns the library.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Returns true if the library has a task beside the interrupt.
    pub fn has_task(&self) -> bool {
        matches!(self.library.description.level, Level::Interrupt(timing) if timing.task_ns.is_some())
    }

    /// Makes a detector, with its library's memory as after loading. `trial`: number of the trial; none to check
    /// whether a detector can be made. `task_at`: time of the task's first run, as a share of its period.
    ///
    /// # Errors
    /// The library's `create` refused, with its message, or the image cannot be loaded.
    pub fn detector(&self, seed: u64, task_at: f64, trial: Option<u64>) -> Result<Foreign, String> {
        let mut image = self.library.image().map_err(|error| error.to_string())?;
        let moment = trial.map_or(Moment::Check, Moment::Trial);
        let site = Site::new(self.library.label, moment);
        let (log, drive) = Log::offered_by(&self.drive);
        let detector = match image.create(site, &drive, &self.config, seed) {
            Ok(detector) => detector,
            Err(refused) => {
                log.say(site);
                self.library.give_back(image);
                return Err(format!("{} refused: {refused}", self.library.description.name));
            }
        };
        let (interrupts, task) = match self.library.description.level {
            Level::Command => (None, None),
            Level::Interrupt(timing) => {
                let first = |period: Nanos| Nanos::from_seconds(period.seconds() * task_at.clamp(0.0, 1.0));
                let task = timing.task_ns.map(Nanos).map(|period| Task { period, next: first(period) });
                (Some(Interrupts::new(timing, Nanos(self.drive.period_ns))), task)
            }
        };
        Ok(Foreign {
            library: Arc::clone(&self.library),
            image: Some(image),
            detector,
            site,
            interrupts,
            task,
            samples: Vec::new(),
            log,
            watched: None,
            drive: self.drive,
            guard: Guard::new(f64::from(self.drive.timer_tick)),
        })
    }
}

/// A periodic task of the library that runs beside its interrupt.
#[derive(Clone, Copy, Debug)]
struct Task {
    period: Nanos,
    /// When it runs next.
    next: Nanos,
}

/// A detector of a library, in a separate image.
pub struct Foreign {
    library: Arc<Library>,
    /// There until it is dropped.
    image: Option<Image>,
    detector: NonNull<c_void>,
    site: Site,
    interrupts: Option<Interrupts>,
    task: Option<Task>,
    samples: Vec<Sample>,
    log: Arc<Log>,
    /// Channels and log, if the detector is traced.
    watched: Option<Watched>,
    /// The drive's data of itself.
    drive: Drive,
    guard: Guard,
}

impl fmt::Debug for Foreign {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a detector of {}", self.library.path.display())
    }
}

/// Numbers of reasons that are the bench's, here and in `guard.rs`: the last ones, so that a library's own are free from 0.
const BROKE_ITS_SIDE: u32 = u32::MAX;

/// Returns a failure caused by a library that violates the header.
pub fn broken(text: &str) -> Fault<f64> {
    Fault::Own(Own { code: BROKE_ITS_SIDE, text: kept(text) })
}

/// Largest angle of a result in rad: beyond it neighbours in single precision are more than 0.003° apart.
const MOST_ANGLE: f32 = 1000.0;

impl From<Beyond> for Fault<f64> {
    fn from(Beyond(name): Beyond) -> Self {
        broken(&format!("it wrote beyond its {name}"))
    }
}

/// Returns a field of the result, if the library has written to it.
fn given(name: &str, value: f32) -> Result<Option<f64>, Fault<f64>> {
    match value {
        value if value.to_bits() == Answer::UNSET.to_bits() => Ok(None),
        value if value.is_nan() => {
            Err(broken(&format!("{name} is {value}, not a number; what is not known stays as it is")))
        }
        value => Ok(Some(f64::from(value))),
    }
}

/// Returns the evidence for the pole, in standard deviations. Evidence without the threshold that the detector needs is refused: any
/// evidence would look sufficient, also that of a start whose pole it does not name.
fn evidence(deviations: Option<f64>, needed: Option<f64>) -> Result<Option<PoleEvidence<f64>>, Fault<f64>> {
    match (deviations, needed) {
        // What it asks for is the same in every start, also where it did not come to ask.
        (None, _) => Ok(None),
        (Some(deviations), Some(needed)) if needed >= 0.0 => Ok(Some(PoleEvidence { deviations, needed })),
        (Some(deviations), needed) => {
            let found = needed.map_or("not given".to_owned(), |needed| needed.to_string());
            Err(broken(&format!(
                "pole_needed is {found} beside a pole_evidence of {deviations}, not 0 or more"
            )))
        }
    }
}

/// Status and result of a call, and a command if the detector continues.
type Asked = (i32, Answer, Option<Command<f64>>);

impl Foreign {
    /// Returns the next step, or the reason why there is none.
    fn next(&mut self, readings: &[Reading<f64>]) -> Result<Step<f64>, Fault<f64>> {
        let call = self.log.next_call();
        self.guard.lasted(readings);
        let asked = self.ask(readings);
        self.look(call);
        let (status, answer, command) = asked?;
        if self.image.as_ref().is_some_and(Image::loaded_late) {
            let text = "it calls dlopen in a detection; in a constructor or in sts_entry, what it loads is part of the run";
            return Err(broken(text));
        }
        if let Some(command) = command {
            // An interrupt's period is the timer's.
            self.guard.pass(&command, self.interrupts.is_some())?;
            return Ok(Step::Drive(command));
        }
        self.done(status, &answer)
    }

    /// Calls the library. Returns status and result, and a command if the detector continues.
    fn ask(&mut self, readings: &[Reading<f64>]) -> Result<Asked, Fault<f64>> {
        self.samples.clear();
        let Some(image) = &mut self.image else { return Err(Fault::UnexpectedReadings) };
        let Some(interrupts) = &mut self.interrupts else {
            self.samples.extend(readings.iter().map(|reading| Sample::of(reading, Nanos::ZERO, 0)));
            let called = image.step(self.site, self.detector, &self.samples)?;
            let (status, command, answer) =
                called.unwrap_or((abi::FAILED, abi::Command::default(), Answer::NONE));
            let go_on = status == abi::GO_ON;
            return Ok((
                status,
                answer,
                if go_on { Some(command::command(&command, &self.drive)?) } else { None },
            ));
        };
        let (mut status, mut answer) = (abi::GO_ON, Answer::NONE);
        if let Some(half) = interrupts.half() {
            let start = interrupts.start();
            self.samples.extend(readings.iter().map(|reading| Sample::of(reading, start, half)));
            let Some(last) = self.samples.last() else { return Err(Fault::UnexpectedReadings) };
            while let Some(task) = &mut self.task
                && task.next.0 < last.time_ns
            {
                self.log.set_time(task.next);
                image.task(self.site, self.detector, task.next.0);
                task.next = task.next + task.period;
            }
            self.log.set_time(Nanos(last.time_ns));
            let called = image.isr(self.site, self.detector, &self.samples, &mut interrupts.legs)?;
            (status, answer) = called.unwrap_or((abi::FAILED, answer));
        }
        Ok((status, answer, if status == abi::GO_ON { Some(interrupts.command()?) } else { None }))
    }

    /// Keeps the channels after a call, also after one that broke a rule.
    fn look(&mut self, call: u64) {
        let (Some(watched), Some(image)) = (&mut self.watched, &mut self.image) else { return };
        let interrupt = self.interrupts.is_some();
        let time = self.samples.last().filter(|_| interrupt).map(|sample| Nanos(sample.time_ns));
        // Before its first sample an interrupt has not run.
        if !interrupt || time.is_some() {
            watched.look(image, self.site, self.detector, call, time);
        }
    }

    /// Keeps the values of the channels after each call from now on, and keeps the log instead of writing it to
    /// standard error.
    pub fn watch(&mut self) {
        self.watched = Some(Watched::default());
    }

    /// Ends the detector, which may log that, too; returns channels since [`Self::watch`] and log.
    pub fn watched(&mut self) -> Watched {
        self.end();
        Watched { log: self.log.take(), ..self.watched.take().unwrap_or_default() }
    }

    /// Ends the detector.
    fn end(&mut self) {
        if let Some(mut image) = self.image.take() {
            image.destroy(self.site, self.detector);
            self.library.give_back(image);
        }
    }

    /// Returns the outcome that the library reports.
    fn done(&mut self, status: i32, answer: &Answer) -> Result<Step<f64>, Fault<f64>> {
        // Of an ideal drive, the root of a sum that rounds to less than 0: not known.
        let deviation = Some(f64::from(answer.angle_deviation)).filter(|deviation| !deviation.is_nan());
        if let Some(deviation) = deviation.filter(|deviation| !(0.0..f64::INFINITY).contains(deviation)) {
            return Err(broken(&format!("angle_deviation is {deviation}, not 0 or more")));
        }
        let age = given("age", answer.age)?;
        if let Some(age) = age.filter(|age| !(0.0..f64::INFINITY).contains(age)) {
            return Err(broken(&format!("age is {age} s, not 0 or more")));
        }
        if let Some(age) = age.filter(|age| !self.guard.has_lasted(*age)) {
            return Err(broken(&format!("age is {age} s, longer than the detection")));
        }
        let findings = Findings {
            angle_deviation: deviation,
            age,
            pole_evidence: evidence(
                given("pole_evidence", answer.pole_evidence)?,
                given("pole_needed", answer.pole_needed)?,
            )?,
            ..Findings::default()
        };
        let angle = || match answer.angle {
            angle if angle.abs() <= MOST_ANGLE => Ok(Angle::from_radians(f64::from(angle))),
            angle if angle.is_finite() => Err(broken(&format!(
                "the angle is {angle:e} rad, of which single precision does not know where in a turn it is; needed: from \
                 -{MOST_ANGLE} to {MOST_ANGLE} rad"
            ))),
            angle => Err(broken(&format!("the angle is {angle}, not a finite number"))),
        };
        Ok(Step::Done(match status {
            abi::FOUND => Outcome::Found { angle: angle()?, findings },
            abi::AXIS => Outcome::Axis {
                angle: angle()?,
                reason: Undetermined::Own(self.reason(answer.reason)),
                findings,
            },
            abi::FAILED => Outcome::Failed { fault: Fault::Own(self.reason(answer.reason)), findings },
            other => {
                let text = format!("status {other}, which is none of 0 to 3 (enum sts_status)");
                Outcome::Failed { fault: broken(&text), findings }
            }
        }))
    }

    fn reason(&mut self, code: u32) -> Own {
        let text = self.image.as_mut().and_then(|image| image.reason(self.site, code));
        Own { code, text: kept(&text.unwrap_or_else(|| format!("reason {code}"))) }
    }
}

impl Detector<f64> for Foreign {
    fn step(&mut self, readings: &[Reading<f64>]) -> Step<f64> {
        self.next(readings)
            .unwrap_or_else(|fault| Step::Done(Outcome::Failed { fault, findings: Findings::default() }))
    }

    fn overdue(&mut self, limit: Nanos) -> Option<Outcome<f64>> {
        Some(Guard::overdue(limit))
    }
}

impl Drop for Foreign {
    fn drop(&mut self) {
        self.end();
        self.log.say(self.site);
    }
}
