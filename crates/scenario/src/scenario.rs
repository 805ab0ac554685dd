//! A scenario: everything that the trials of a campaign have in common.

use std::f64::consts::TAU;

use standstill_detect::{
    Decay, LineInductanceSettings, Method, MethodName, Nameplate, Settings, SettingsError, Source,
};
use standstill_foreign::{Maker, kept};
use standstill_interface::{Detector, Nanos};
use standstill_plant::Motor;
use standstill_sim::{
    Case, Faults, NoProbe, Play, Purpose, RotorState, Run, SensorSettings, Sensors, Streams, Tape, Tolerance,
    Trace, run,
};

use crate::errors::{dc_link, device_kind};
use crate::known::{nameplate, sources};
use crate::side_by_side::side_by_side;
use crate::{DriveSettings, ErrorSet, FaultSettings, Hosted, Made, Record, TrialError, faults};

/// A scenario, ready to run: one motor, one type of drive, and one detection method with its settings `S`. All its trials share them.
#[derive(Clone, Debug, PartialEq)]
pub struct Scenario<S = LineInductanceSettings<f64>> {
    /// The motor.
    pub motor: Motor,
    /// Motion of the rotor: held, free, braked or driven. Each trial draws the initial position within the play of the brake.
    pub rotor: RotorState,
    /// Electrical angle in rad at the start of every trial. None if each trial draws an angle.
    pub start_angle: Option<f64>,
    /// Torque in N·m that the load exerts against forward motion.
    pub load_torque: f64,
    /// Speed in revolutions per minute at the start of a trial. It applies to a rotor that is free or driven.
    pub start_speed: f64,
    /// Acceleration in revolutions per minute and second of a rotor that is driven.
    pub acceleration: f64,
    /// True if the stator's iron has remanence from former operation. Each trial then draws the direction of the remanence.
    pub memory: bool,
    /// Settings of the drive. Each trial draws from these one specimen: its gate delays and the phase of its DC-link ripple.
    pub drive: DriveSettings,
    /// Settings of the drive's sensors. From these, each trial draws one specimen with its gains, offsets and further errors.
    pub sensors: SensorSettings,
    /// Faults of motor, inverter, sensors and software. Each trial draws the place, the size and the onset of each fault.
    pub faults: Vec<FaultSettings>,
    /// Settings of the method.
    pub detector: S,
    /// Factory of detectors from a shared library. They replace the detectors of the method. None without a library.
    pub foreign: Option<Maker>,
    /// Factory of detectors of the running program, such as a Python class. They replace those of method and library. None without a class.
    pub hosted: Option<Hosted>,
    /// Longest simulated time that a detection may take.
    pub time_limit: Nanos,
    /// Numerical tolerance of the integrator.
    pub tolerance: Tolerance,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Longest time in s between two points of a recorded waveform. Switching edges and other sudden changes add points.
const RESOLUTION: f64 = 5e-6;

/// Trial numbers that select the random numbers of a case: one for the drive and its sensors, one for the noise.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Specimen {
    /// Number of the trial that gives the errors of drive and sensors: gains, offsets, delays.
    pub drive: u64,
    /// Number of the trial that gives noise and jitter.
    pub noise: u64,
}

/// Returns the integrator's tolerance: the default or 1e-8 of rated current times smaller inductance, whichever is smaller.
pub(crate) fn tolerance(motor: &Motor) -> Tolerance {
    let winding = &motor.winding;
    let inductance = winding.d_axis_inductance().min(winding.q_axis_inductance());
    Tolerance { flux: Tolerance::default().flux.min(1e-8 * inductance * motor.rated_current) }
}

impl Scenario {
    /// Makes a scenario of the paper's method on this motor with one of the error sets. The DC link has the motor's nominal voltage. The
    /// method assumes the sign of L_q − L_d that the motor has.
    pub fn paper(motor: Motor, errors: ErrorSet, decay: Decay, rotor: RotorState, seed: u64) -> Self {
        Scenario::new(motor, errors, rotor, seed, |drive| LineInductanceSettings::paper(decay, drive))
    }
}

impl Scenario<Method<f64>> {
    /// Makes a scenario of a method with the default settings for this motor, and with one of the error sets. The DC link has the motor's
    /// nominal voltage. If the method reads terminal voltages, the drive has voltage dividers at its terminals.
    pub fn of_method(
        method: MethodName,
        motor: Motor,
        errors: ErrorSet,
        rotor: RotorState,
        seed: u64,
    ) -> Self {
        let mut scenario = Scenario::new(motor, errors, rotor, seed, |drive| Method::suited(method, drive));
        if scenario.detector.sources() == [Source::Terminals] {
            scenario.sensors.terminal = Some(errors.dividers(scenario.motor.rated_current, &scenario.drive));
            scenario.detector = Method::suited(method, &scenario.nameplate());
        }
        scenario
    }
}

impl<S: Settings<f64>> Scenario<S> {
    /// Makes a scenario of a method on this motor with one of the error sets. The DC link has the motor's nominal voltage. `settings`
    /// derives the method's settings from the nameplate.
    pub fn new(
        motor: Motor,
        errors: ErrorSet,
        rotor: RotorState,
        seed: u64,
        settings: impl FnOnce(&Nameplate<f64>) -> S,
    ) -> Self {
        let dc_link = dc_link(&motor);
        let drive = errors.drive(&motor, device_kind(&motor));
        let sensors = errors.sensors(motor.rated_current, dc_link);
        let detector = settings(&nameplate(&motor, &drive, &sensors));
        Self {
            tolerance: tolerance(&motor),
            motor,
            rotor,
            start_angle: None,
            load_torque: 0.0,
            start_speed: 0.0,
            acceleration: 0.0,
            memory: false,
            drive,
            sensors,
            faults: Vec::new(),
            detector,
            foreign: None,
            hosted: None,
            time_limit: Case::TIME_LIMIT,
            seed,
        }
    }

    /// Returns the nameplate: the data of motor, inverter and sensors that the drive knows from data sheets.
    pub fn nameplate(&self) -> Nameplate<f64> {
        nameplate(&self.motor, &self.drive, &self.sensors)
    }

    /// Returns the kinds of readings that the drive's sensors provide: phase currents, DC-link current, terminal voltages, captured times.
    pub fn sources(&self) -> Vec<Source> {
        let sensors = &self.sensors;
        sources(sensors.arrangement, sensors.terminal.is_some(), sensors.comparator.timer > 0.0)
    }

    /// Returns true if the drive has readings that suffice for a method with these settings.
    pub(crate) fn serves(&self, settings: &impl Settings<f64>) -> bool {
        Source::any_of(settings.sources(), &self.sources())
    }

    /// Checks that the drive provides the readings and the carrier period of the method, and that a detector can be made.
    ///
    /// # Errors
    /// A setting does not fit. The error names the first such setting.
    pub fn check(&self) -> Result<(), SettingsError> {
        if !self.serves(&self.detector) {
            return Err(SettingsError {
                setting: "sensors",
                needed: "such that the drive has the readings of the method",
            });
        }
        if self.detector.carrier_period().is_some_and(|period| period != self.drive.carrier_period) {
            let needed = "the carrier period of the drive";
            return Err(SettingsError { setting: "polarity.carrier_period", needed });
        }
        self.try_detector()
    }

    /// Checks that the detector can be made. Detectors of the running program or of another process's library are not checked.
    pub(crate) fn try_detector(&self) -> Result<(), SettingsError> {
        if self.hosted.is_some() {
            return Ok(());
        }
        match &self.foreign {
            Some(foreign) if !foreign.library().is_here() => Ok(()),
            _ => self.made(&self.case(0), None).map(|_| ()),
        }
    }

    /// Makes the detector for a case. The running program provides it if it has one, otherwise the library, otherwise the method. A
    /// detector of program or library receives a seed drawn from the case's random numbers.
    ///
    /// # Errors
    /// The method's detector cannot work with its settings, or the library refuses them with a message.
    pub fn detector_for(&self, case: &Case) -> Result<Made<S::Detector>, SettingsError> {
        self.made(case, Some(case.streams.index()))
    }

    /// Makes the detector of a case. `trial` is the trial number that the detector receives; none if the detector is only a check.
    fn made(&self, case: &Case, trial: Option<u64>) -> Result<Made<S::Detector>, SettingsError> {
        let drawn = || {
            let mut draws = case.streams.open(Purpose::Detector);
            // One draw has only 48 bits, a seed has 64.
            let [high, low] = [(); 2].map(|()| draws.integer(u64::from(u32::MAX)));
            (high << 32 | low, draws)
        };
        match (&self.hosted, &self.foreign) {
            (Some(Hosted { provider, given }), _) => {
                Ok(Made::Hosted(provider.detector(given, drawn().0, trial.unwrap_or_default())))
            }
            (None, Some(foreign)) => {
                let (seed, mut draws) = drawn();
                let task_at = if foreign.has_task() { draws.uniform() } else { 0.0 };
                let detector = foreign.detector(seed, task_at, trial);
                detector.map(Made::Foreign).map_err(|refused| SettingsError::own(kept(&refused)))
            }
            (None, None) => self.detector.detector().map(Box::new).map(Made::Own),
        }
    }

    /// Returns the case of a trial. A case contains a rotor angle and a specimen of the drive and its sensors.
    pub fn case(&self, trial: u64) -> Case<'_> {
        self.case_of(Streams::new(self.seed, trial))
    }

    /// Returns the case of a trial whose random draws come from a tape.
    pub fn case_taped<'a>(&'a self, tape: &'a Tape) -> Case<'a> {
        self.case_of(Streams::taped(tape))
    }

    pub(crate) fn case_of<'a>(&'a self, streams: Streams<'a>) -> Case<'a> {
        let angle = self.start_angle.unwrap_or_else(|| streams.open(Purpose::Angle).angle());
        self.case_from(angle, streams, streams)
    }

    /// Returns the case with this electrical angle of the rotor in rad and the random numbers of `specimen`. If the friction cannot hold a
    /// free rotor at this angle against cogging and load, the rotor starts at the angle at which it comes to rest.
    pub fn case_at(&self, angle: f64, specimen: Specimen) -> Case<'_> {
        let [drive, noise] = [specimen.drive, specimen.noise].map(|trial| Streams::new(self.seed, trial));
        self.case_from(angle, drive, noise)
    }

    fn case_from<'a>(&'a self, angle: f64, drive: Streams<'a>, noise: Streams<'a>) -> Case<'a> {
        let mut angle = angle;
        let mut rotor = self.rotor;
        match &mut rotor {
            RotorState::Locked | RotorState::Driven => {}
            // A rotor that turns has no angle of rest.
            RotorState::Free if self.start_speed != 0.0 => {}
            RotorState::Free => angle = self.motor.standing_angle(angle, self.load_torque).unwrap_or(angle),
            RotorState::Braked(play) => *play = self.standing_play(angle, *play, drive),
        }
        // From rpm to rad/s.
        let electrical = f64::from(self.motor.pole_pairs) * (TAU / 60.0);
        let mut case = Case {
            motor: &self.motor,
            inverter: self.drive.draw(drive),
            sensors: Sensors::draw(self.sensors, drive),
            start_angle: angle,
            rotor,
            memory: self.memory.then(|| drive.open(Purpose::Memory).angle()),
            load_torque: self.load_torque,
            start_speed: self.start_speed * electrical,
            acceleration: self.acceleration * electrical,
            streams: noise,
            tolerance: self.tolerance,
            time_limit: self.time_limit,
            faults: Faults::default(),
        };
        faults::apply(&self.faults, &mut case, drive);
        case
    }

    /// Returns the brake's play below and above the rotor's initial position, in rad electrical. The initial position is drawn uniformly
    /// within the play. If cogging and load exceed the stiction, it is the stop to which they turn the rotor.
    fn standing_play(&self, angle: f64, play: Play, streams: Streams) -> Play {
        let whole = play.below + play.above;
        let torque = self.motor.cogging(angle) - self.load_torque;
        let below = if torque.abs() <= self.motor.rotor.friction.stiction {
            whole * streams.open(Purpose::Backlash).uniform()
        } else if torque > 0.0 {
            whole
        } else {
            0.0
        };
        Play { below, above: whole - below }
    }

    /// Runs a trial with the scenario's detector.
    ///
    /// # Errors
    /// The detector cannot work with its settings.
    pub fn trial(&self, trial: u64) -> Result<Record, SettingsError> {
        Ok(self.trial_with(trial, &mut self.detector_for(&self.case(trial))?))
    }

    /// Runs trials side by side in this thread, which is several times as fast as one after the other. `done` receives each record when its
    /// trial ends.
    ///
    /// # Errors
    /// No detector can be made for a trial. Then no further trial begins, and trials that have begun are completed.
    pub fn trials(
        &self,
        trials: impl IntoIterator<Item = u64>,
        mut done: impl FnMut(Record),
    ) -> Result<(), TrialError<SettingsError>> {
        let of = |trial| (self, Streams::new(self.seed, trial));
        side_by_side(trials.into_iter().map(of), |_, record| done(record))
    }

    /// Runs a trial with the scenario's detector. The random draws come from a tape, and the record has the tape's trial number.
    ///
    /// ```
    /// use standstill_scenario::{ErrorSet, Scenario};
    /// use standstill_detect::MethodName;
    /// use standstill_plant::built_in;
    /// use standstill_sim::{Purpose, RotorState, Tape};
    ///
    /// let motor = built_in("paper-5k5").expect("a built-in motor");
    /// let method = MethodName::LineInductanceFast;
    /// let scenario = Scenario::of_method(method, motor, ErrorSet::Default, RotorState::Locked, 1);
    /// // An empty tape with the scenario's seed gives trial 5 of the campaign, and then holds the draws of that trial.
    /// let mut tape = Tape::new(scenario.seed, 5);
    /// assert_eq!(scenario.trial_taped(&tape), scenario.trial(5));
    /// assert_eq!(tape.normals(Purpose::CurrentGain).len(), 3);
    /// // What if the sensor of phase b read three standard deviations too much?
    /// tape.normals(Purpose::CurrentGain)[1] = 3.0;
    /// assert_eq!(scenario.case_taped(&tape).sensors.gain[1], 1.015);
    /// assert_ne!(scenario.trial_taped(&tape), scenario.trial(5));
    /// ```
    pub fn trial_taped(&self, tape: &Tape) -> Result<Record, SettingsError> {
        let case = self.case_taped(tape);
        let run = run(&case, &mut self.detector_for(&case)?, false, &mut NoProbe);
        Ok(Record { trial: tape.index(), run })
    }

    /// Runs trials side by side in this thread. The random draws of each trial come from a tape. `done` receives each record when its trial
    /// ends, with the index of its tape in `tapes`.
    ///
    /// # Errors
    /// No detector can be made for a tape. Then no further trial begins, and trials that have begun are completed.
    pub fn trials_taped(&self, tapes: &[Tape], done: impl FnMut(usize, Record)) -> Result<(), SettingsError> {
        Ok(side_by_side(tapes.iter().map(|tape| (self, Streams::taped(tape))), done)?)
    }

    /// Runs a case twice. The first run is the same, bit by bit, as in a campaign; the second run has an observer. Returns the record of
    /// the first run, the second run, and its waveforms. Their points are 5 µs apart, or further apart to limit their number to about
    /// `most_rows`. With `ledger`, the second run also integrates energies, which changes its steps slightly. A library's detector logs as
    /// in a campaign.
    ///
    /// # Errors
    /// The detector cannot work with its settings.
    pub fn watched(
        &self,
        case: &Case,
        ledger: bool,
        most_rows: f64,
    ) -> Result<(Record, Run<f64>, Trace), SettingsError> {
        self.twice(case, false, (ledger, most_rows))
    }

    /// Runs a case twice as [`Self::watched`] does. The waveforms also contain the channels and the log of a library's detector.
    ///
    /// # Errors
    /// The detector cannot work with its settings.
    pub fn traced(
        &self,
        case: &Case,
        ledger: bool,
        most_rows: f64,
    ) -> Result<(Record, Run<f64>, Trace), SettingsError> {
        self.twice(case, true, (ledger, most_rows))
    }

    /// Runs a case without an observer, then with an observer and a second detector. With `shows`, the trace contains channels and log of
    /// the second detector, and the log of the first detector is dropped. Without `shows`, the log of the second detector is dropped.
    fn twice(
        &self,
        case: &Case,
        shows: bool,
        (ledger, most_rows): (bool, f64),
    ) -> Result<(Record, Run<f64>, Trace), SettingsError> {
        let mut first = self.detector_for(case)?;
        let alone = run(case, &mut first, false, &mut NoProbe);
        let mut trace = Trace::new(RESOLUTION.max(alone.duration.seconds() / most_rows));
        if shows {
            first.shown(&trace, 0.0);
        }
        drop(first);
        let mut second = self.detector_for(case)?;
        if shows {
            second.watch();
        }
        let observed = run(case, &mut second, ledger, &mut trace);
        let own = second.shown(&trace, observed.duration.seconds());
        if shows {
            trace.own = own;
        }
        Ok((Record { trial: case.streams.index(), run: alone }, observed, trace))
    }

    /// Runs a trial with `detector` instead of the scenario's detector.
    pub fn trial_with(&self, trial: u64, detector: &mut dyn Detector<f64>) -> Record {
        Record { trial, run: run(&self.case(trial), detector, false, &mut NoProbe) }
    }
}
