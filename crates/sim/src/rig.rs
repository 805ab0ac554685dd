//! The one loop: command → gate edges → conduction → voltage → flux → current → reading → detector → command.

mod advance;
mod deferred;
mod events;

use standstill_interface::{Command, Detector, Dq, Leg, Nanos, Reading, Real, Sampling, Step};
use standstill_inverter::{Gate, Port};
use standstill_numeric::Heading;

use self::advance::Span;
use self::deferred::{Deferred, Due};
use crate::case::{Case, Ended, Play, RotorState, Run, RunError, Work};
use crate::flow::Flow;
use crate::lanes::{Alone, Steps, at_once};
use crate::ledger::Ledger;
use crate::machine::{CORE, WITH_EDDY, WITH_LEDGER};
use crate::motion::{Contact, Motion};
use crate::sensing::{Instant, LowPass, Sampler};
use crate::timeline::Timeline;
use crate::trace::{Event, Probe, Snapshot};

/// Samples that a command may ask for: more than any method needs, fewer than exhaust the memory.
const MOST_SAMPLES: u32 = 1 << 20;

/// Carries out one detection from rest.
///
/// `ledger` asks for the energies, which are integrated along and cost time.
pub fn run<T: Real, D: Detector<T> + ?Sized>(
    case: &Case,
    detector: &mut D,
    ledger: bool,
    probe: &mut impl Probe,
) -> Run<T> {
    if ledger {
        at_once(Rig::<WITH_LEDGER, _, _>::new(case, probe, Alone).detect(detector))
    } else if case.motor.magnetics.eddy_currents().is_some() {
        at_once(Rig::<WITH_EDDY, _, _>::new(case, probe, Alone).detect(detector))
    } else {
        at_once(Rig::<CORE, _, _>::new(case, probe, Alone).detect(detector))
    }
}

/// Motor, bridge, link, sensors and time: the state of a run.
pub(crate) struct Rig<'a, const N: usize, P, S> {
    case: &'a Case<'a>,
    /// Who carries out the steps.
    steps: S,
    probe: &'a mut P,
    flow: Flow<'a>,
    timeline: Timeline,
    sampler: Sampler<'a>,
    filters: Option<[LowPass; 3]>,
    link_filter: Option<LowPass>,
    state: [f64; N],
    tolerance: [f64; N],
    /// Longest step in s: a fraction of the ripple's period where the link's voltage follows it.
    longest_step: f64,
    /// The instant at hand.
    now: Nanos,
    /// The instant up to which the flow has been carried, and the time in s since then.
    reached: Nanos,
    elapsed: f64,
    /// The way to the instant at hand.
    span: Span,
    /// What happened between the two, nothing of which changes the flow.
    deferred: Deferred,
    /// The machine at the state as the bridge sees it, if that is known.
    here: Option<Port>,
    /// Whether time has passed since then in which nothing happened.
    waited: bool,
    /// Length of the step to try next, in s.
    step_hint: f64,
    moved: f64,
    peak_current: f64,
    /// Energy in J lost where the rotor ran into the end of the brake's play.
    impact_loss: f64,
    work: Work,
}

/// A command on its way.
struct Course {
    start: Nanos,
    end: Nanos,
    sampling: Sampling,
    /// Of the trigger after the one that is pending.
    number: u32,
    /// The next trigger: its nominal time after the start, and when it really samples.
    pending: Option<(Nanos, Nanos)>,
}

/// What the flow must be carried to.
enum Next {
    /// The trigger of this nominal time.
    Sample(Nanos),
    /// These gate edges, of which one changes the flow.
    Switch([Option<Gate>; 3]),
    /// An instant of the DC source.
    Source,
    /// The end of the command.
    End,
}

impl<'a, const N: usize, P: Probe, S: Steps> Rig<'a, N, P, S> {
    pub(crate) fn new(case: &'a Case<'a>, probe: &'a mut P, steps: S) -> Self {
        let Case { motor, inverter, .. } = case;
        let torque = motor.cogging(case.start_angle) - case.load_torque;
        let (motion, stops) = match case.rotor {
            RotorState::Locked => (Motion::Held, None),
            RotorState::Free => (Motion::resolve(&motor.rotor, 0.0, torque, Contact::None), None),
            RotorState::Braked(play) if play.below + play.above <= 0.0 => (Motion::Held, None),
            RotorState::Braked(play) => {
                let contact = match play {
                    Play { above: 0.0, .. } => Contact::Upper,
                    Play { below: 0.0, .. } => Contact::Lower,
                    Play { .. } => Contact::None,
                };
                let stops = [case.start_angle - play.below, case.start_angle + play.above];
                (Motion::resolve(&motor.rotor, 0.0, torque, contact), Some(stops))
            }
        };
        let flux = motor.open_circuit_flux(case.start_angle);
        let mut state = [0.0; N];
        state[..CORE].copy_from_slice(&[
            flux.alpha,
            flux.beta,
            case.start_angle,
            0.0,
            inverter.link.source(0.0),
        ]);
        if N >= WITH_EDDY {
            let Dq { d, q } = motor.magnetics.rest(Heading::of(case.start_angle));
            state[CORE..WITH_EDDY].copy_from_slice(&[d, q]);
        }
        let mut flow = Flow::new(motor, &inverter.bridge, &inverter.link, motion);
        flow.machine.load_torque = case.load_torque;
        flow.stops = stops;
        flow.turn(motion, case.start_angle);
        steps.legs_changed(&flow.machine, &flow.limits);
        steps.motion_changed(&flow.machine, &flow.limits);
        let settings = &case.sensors.settings;
        Self {
            case,
            steps,
            probe,
            flow,
            timeline: Timeline::new(inverter.gates),
            sampler: Sampler::new(case.sensors, case.streams),
            filters: settings.bandwidth.map(|corner| [LowPass::new(corner, 0.0); 3]),
            link_filter: settings
                .dc_link
                .bandwidth
                .map(|corner| LowPass::new(corner, inverter.link.source(0.0))),
            state,
            tolerance: tolerances(case),
            longest_step: match inverter.link.storage {
                Some(_) if inverter.link.ripple != 0.0 => 0.125 / inverter.link.ripple_frequency,
                _ => f64::INFINITY,
            },
            now: Nanos::ZERO,
            reached: Nanos::ZERO,
            elapsed: 0.0,
            span: Span::default(),
            deferred: Deferred::new(),
            here: None,
            waited: false,
            step_hint: f64::INFINITY,
            moved: 0.0,
            peak_current: 0.0,
            impact_loss: 0.0,
            work: Work::default(),
        }
    }

    pub(crate) async fn detect<T: Real, D: Detector<T> + ?Sized>(mut self, detector: &mut D) -> Run<T> {
        let before = (self.flow.field_energy(&self.state), self.flow.link_energy(&self.state));
        let mut readings: Vec<Reading<T>> = Vec::new();
        let ended = loop {
            match detector.step(&readings) {
                Step::Done(outcome) => match self.catch_up().await {
                    Ok(()) => break Ended::Outcome(outcome),
                    Err(error) => break Ended::Error(error),
                },
                Step::Drive(command) => {
                    readings.clear();
                    if let Err(error) = self.carry_out(&command, &mut readings).await {
                        break Ended::Error(error);
                    }
                }
            }
        };
        let ledger = (N == WITH_LEDGER).then(|| Ledger {
            source: self.state[WITH_EDDY],
            source_loss: self.state[WITH_EDDY + 1],
            device_loss: self.state[WITH_EDDY + 2],
            copper_loss: self.state[WITH_EDDY + 3],
            eddy_loss: self.state[WITH_EDDY + 4],
            shaft_work: self.state[WITH_EDDY + 5],
            friction_loss: self.state[WITH_EDDY + 6],
            load_work: self.state[WITH_EDDY + 7],
            impact_loss: self.impact_loss,
            field_change: self.flow.field_energy(&self.state) - before.0,
            link_change: self.flow.link_energy(&self.state) - before.1,
            kinetic_change: self.flow.kinetic_energy(&self.state),
        });
        Run {
            ended,
            duration: self.reached,
            start_angle: self.case.start_angle,
            end_angle: self.state[2],
            has_pole: self.case.motor.has_magnet(),
            resolver_angle: self.state[2] + self.case.sensors.resolver_error,
            moved: self.moved,
            peak_current: self.peak_current,
            ledger,
            work: self.work,
        }
    }

    /// Carries out one command. At each instant: first the samples, then the gates.
    async fn carry_out<T: Real>(
        &mut self,
        command: &Command<T>,
        readings: &mut Vec<Reading<T>>,
    ) -> Result<(), RunError> {
        if let Err(error) = validate(command, self.case.inverter.carrier_period) {
            self.catch_up().await?;
            return Err(error);
        }
        let start = self.now;
        let end = start + command.duration();
        if end <= start || end > self.case.time_limit {
            self.catch_up().await?;
            return Err(RunError::TimeLimit(self.case.time_limit));
        }
        if self.deferred.is_nearly_full() {
            self.catch_up().await?;
        }
        self.deferred.push(self.now, Due::Command);
        self.timeline.begin(command, start, self.case.inverter.carrier_period);
        let mut course = Course { start, end, sampling: command.sampling, number: 0, pending: None };
        self.next_trigger(&mut course);
        loop {
            match self.proceed(&mut course) {
                Next::Sample(nominal) => {
                    // The drive knows what it told the legs at the trigger, not when the sample was really taken.
                    let told = self.timeline.told(start + nominal);
                    if !self.is_there() {
                        self.catch_up().await?;
                    }
                    readings.push(self.sample(nominal, told));
                    self.next_trigger(&mut course);
                }
                Next::Switch(edges) => {
                    if !self.is_there() {
                        self.catch_up().await?;
                    }
                    for (k, gate) in edges.into_iter().enumerate() {
                        if let Some(gate) = gate {
                            self.carry(Due::Gate(k, gate));
                        }
                    }
                    self.resolve()?;
                }
                Next::Source => self.catch_up().await?,
                Next::End => return Ok(()),
            }
        }
    }

    /// Goes on in time to what the flow must be carried to.
    fn proceed(&mut self, course: &mut Course) -> Next {
        loop {
            if let Some((nominal, at)) = course.pending
                && at <= self.now
            {
                return Next::Sample(nominal);
            }
            if self.now >= course.end {
                return Next::End;
            }
            if self.timeline.next() <= self.now {
                let edges = self.timeline.take(self.now);
                let full = self.deferred.is_nearly_full();
                let matters = |k: usize| edges[k].is_some_and(|gate| self.matters(k, gate));
                if matters(0) || matters(1) || matters(2) || full && edges != [None; 3] {
                    return Next::Switch(edges);
                }
                for (k, gate) in edges.into_iter().enumerate() {
                    if let Some(gate) = gate {
                        self.deferred.push(self.now, Due::Gate(k, gate));
                    }
                }
            }
            let sample = course.pending.map_or(course.end, |(_, at)| at);
            self.now = self.timeline.next().min(sample).min(course.end);
            if self.case.inverter.link.sag.is_some()
                && let Some(source) = self.next_source_instant()
                && source <= self.now
            {
                self.now = source;
                return Next::Source;
            }
        }
    }

    /// The next instant of the DC source: begin, middle and end of a sag, which a long step could miss.
    fn next_source_instant(&self) -> Option<Nanos> {
        let sag = self.case.inverter.link.sag?;
        [0.0, 0.5, 1.0]
            .into_iter()
            .map(|share| Nanos::from_seconds(sag.start + share * sag.duration))
            .find(|at| *at > self.now)
    }

    fn next_trigger(&mut self, course: &mut Course) {
        let Course { start, end, sampling, number, .. } = *course;
        course.pending = (number < sampling.count).then(|| {
            let nominal = sampling.trigger(number);
            // Jitter may bring two triggers out of order; a converter takes them one after the other.
            (nominal, self.sampler.instant(start + nominal, start, end).max(self.now))
        });
        course.number += 1;
    }

    fn sample<T: Real>(&mut self, nominal: Nanos, requested: [Gate; 3]) -> Reading<T> {
        debug_assert!(self.reached == self.now, "what is sampled is there");
        let at = self.here();
        let unfiltered = self.case.sensors.settings.seen(at.current, self.flow.modes());
        let current = self.filters.map_or(unfiltered, |filters| filters.map(|filter| filter.output()));
        let dc_link = self.link_filter.map_or(at.dc_link, |filter| filter.output());
        let there = Instant { current, dc_link, requested };
        let reading: Reading<T> = self.sampler.read(nominal, &there);
        let seen = reading.current.map(Real::to_double).0;
        self.probe.event(self.now.seconds(), Event::Sample(seen, reading.dc_link.to_double()));
        reading
    }

    /// Reports the state at `time` to the probe.
    fn show(&mut self, time: f64, state: &[f64; N]) {
        let at = self.flow.operating(time, state);
        let (potential, port) = (self.flow.potentials(&at), self.flow.machine.port(&at));
        self.probe.snapshot(&Snapshot {
            time,
            current: port.current,
            potential,
            dc_link: port.dc_link,
            angle: state[2],
            speed: state[3],
            torque: at.torque,
            modes: self.flow.modes(),
        });
    }
}

/// Absolute tolerances of the state, all from the one of the flux: what moves a current as much.
pub(crate) fn tolerances<const N: usize>(case: &Case) -> [f64; N] {
    let flux = case.tolerance.flux;
    // An angle error turns the magnet's flux; a speed error does within a millisecond.
    let angle = flux / case.motor.magnet_flux.max(0.1);
    let mut all = [0.0; N];
    all[..CORE].copy_from_slice(&[flux, flux, angle, angle * 1e3, flux * 1e5]);
    if N >= WITH_EDDY {
        all[CORE..WITH_EDDY].fill(flux);
        // Energies: the flux at about rated current.
        all[WITH_EDDY..].fill(flux * case.motor.rated_current);
    }
    all
}

/// Whether a command can be carried out.
pub(crate) fn validate<T: Real>(command: &Command<T>, carrier: Nanos) -> Result<(), RunError> {
    let duration = command.duration();
    let sampling = command.sampling;
    let too_many = sampling.count > MOST_SAMPLES;
    if duration == Nanos::ZERO || too_many || sampling.last().is_some_and(|last| last > duration) {
        return Err(RunError::BadCommand);
    }
    let stages = [Some(command.stage), command.then];
    let nonsense =
        |leg: &Leg<T>| matches!(leg, Leg::Duty(duty) if !duty.is_finite() || carrier == Nanos::ZERO);
    if stages.iter().flatten().any(|stage| stage.legs.0.iter().any(nonsense)) {
        return Err(RunError::BadDuty);
    }
    Ok(())
}
