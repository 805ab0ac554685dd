//! From one instant to the next: steps, and what is carried along with them.

use standstill_interface::Phase;
use standstill_inverter::{Conduction, Gate};

use super::Rig;
use super::deferred::Due;
use crate::case::RunError;
use crate::flow::{CORE, Operating, PLANE};
use crate::integrator::STAGES;
use crate::step::{Trial, step};
use crate::trace::{Event, Probe};

/// Events within one segment beyond which the modes are taken to chatter. A segment of a PWM period has at most
/// a handful.
const MOST_EVENTS: u32 = 1000;

impl<const N: usize, P: Probe> Rig<'_, N, P> {
    /// Time in s since the start of the run.
    pub(super) fn time(&self) -> f64 {
        self.reached.seconds() + self.elapsed
    }

    /// The machine at the state.
    pub(super) fn here(&mut self) -> Operating {
        if let Some(here) = self.here {
            return here;
        }
        let here = self.flow.operating(self.time(), &self.state);
        self.here = Some(here);
        here
    }

    /// Whether new gates of a leg change the flow: unless its current flows through the same device as before.
    pub(super) fn matters(&self, leg: usize, gate: Gate) -> bool {
        let mode = self.flow.modes()[leg];
        let after = match mode.direction() {
            0.0 => return true,
            direction if direction > 0.0 => Conduction::outflow(gate),
            _ => Conduction::inflow(gate),
        };
        after != mode
    }

    /// Carries the flow to the instant at hand.
    pub(super) fn catch_up(&mut self) -> Result<(), RunError> {
        let span = (self.now - self.reached).seconds();
        self.elapsed = 0.0;
        if span > 0.0 {
            self.work.segments += 1;
            if self.probe.resolution().is_some() {
                let state = self.state;
                self.show(self.time(), &state);
            }
            let mut events = 0;
            while self.elapsed < span {
                let stop = if events == 0 { span } else { self.next_that_matters(span)? };
                if stop <= self.elapsed {
                    continue;
                }
                if self.rests() {
                    self.wait(stop);
                } else if self.step(stop)? {
                    events += 1;
                    if events > MOST_EVENTS {
                        return Err(RunError::Chatter);
                    }
                }
            }
        }
        self.carry_until(f64::INFINITY);
        self.reached = self.now;
        self.elapsed = 0.0;
        self.project();
        Ok(())
    }

    /// After a change of modes: when the next waiting change that now matters is, at the end of the span at the latest.
    /// One that is due is carried out.
    fn next_that_matters(&mut self, span: f64) -> Result<f64, RunError> {
        let matters = self.deferred.waiting().iter().find(|(_, due)| match due {
            Due::Command => false,
            Due::Gate(leg, gate) => self.matters(*leg, *gate),
        });
        let Some((at, _)) = matters else { return Ok(span) };
        let stop = (*at - self.reached).seconds();
        if stop <= self.elapsed {
            self.carry_until(stop);
            self.project();
            self.resolve()?;
        }
        Ok(stop.min(span))
    }

    /// Carries out the changes that waited for up to `elapsed` seconds since the last instant.
    fn carry_until(&mut self, elapsed: f64) {
        while let Some((at, _)) = self.deferred.waiting().first()
            && (*at - self.reached).seconds() <= elapsed
            && let Some((at, due)) = self.deferred.take()
        {
            self.carry_at(at.seconds(), due);
        }
    }

    /// Carries out a change of the instant at hand.
    pub(super) fn carry(&mut self, due: Due) {
        self.carry_at(self.now.seconds(), due);
    }

    fn carry_at(&mut self, time: f64, due: Due) {
        let event = match due {
            Due::Command => Event::Command,
            Due::Gate(leg, gate) => {
                self.flow.gates[leg] = gate;
                Event::Gate(Phase::ALL[leg], gate)
            }
        };
        self.probe.event(time, event);
    }

    /// Whether nothing happens before the next instant: no current, no motion, and nothing stored that could drive any.
    fn rests(&self) -> bool {
        let link = self.flow.machine.link;
        self.flow.modes() == [Conduction::Blocked; 3]
            && !self.flow.motion().moves()
            && self.case.motor.magnetics.eddy_currents().is_none()
            && link.storage.is_none()
            && link.sag.is_none()
    }

    /// Lets time pass up to `elapsed` seconds since the last instant while nothing happens.
    fn wait(&mut self, elapsed: f64) {
        let begin = self.time();
        let h = elapsed - self.elapsed;
        let state = self.state;
        self.watch(begin, h, |_| state);
        self.filter(begin, h, |_| state);
        (self.here, self.slope) = (None, None);
        self.elapsed = elapsed;
    }

    /// One accepted step, to `stop` at most, in s since the last instant; true if it ended in an event.
    fn step(&mut self, stop: f64) -> Result<bool, RunError> {
        if N == CORE && !self.flow.motion().moves() && self.flow.machine.link.storage.is_none() {
            // Nothing but the flux changes.
            self.step_of::<PLANE>(stop)
        } else {
            self.step_of::<N>(stop)
        }
    }

    /// The same of the first `M` numbers of the state.
    fn step_of<const M: usize>(&mut self, stop: f64) -> Result<bool, RunError> {
        let slope = if let Some(slope) = self.slope {
            part(&slope)
        } else {
            self.work.derivatives += 1;
            let here = self.here();
            self.flow.machine.evaluate_at::<M>(self.time(), &part(&self.state), here).slope
        };
        let remaining = stop - self.elapsed;
        let mut h = remaining.min(self.step_hint).min(self.longest_step);
        let trial = loop {
            let trial = self.attempt::<M>(&slope, h);
            let error = trial.error;
            if error <= 1.0 {
                // A step cut short by the end of the span says little about the next one's length.
                let next = trial.attempt.next_length(error);
                self.step_hint = if h < self.step_hint { next.max(self.step_hint) } else { next };
                break trial;
            }
            if h < 1e-15 {
                return Err(RunError::NotFinite);
            }
            self.step_hint = trial.attempt.next_length(error).min(0.9 * h);
            h = self.step_hint;
        };
        if let Some((which, share)) = self.find_event(&trial) {
            let cut = self.attempt::<M>(&slope, h * share);
            self.accept(&cut);
            self.slope = None;
            // A cut of no length still ends the mode that it was to end.
            self.elapsed = (self.elapsed + cut.attempt.h).min(stop);
            self.carry_until(self.elapsed);
            self.work.events += 1;
            self.handle_event(which)?;
            if self.probe.resolution().is_some() {
                let state = self.state;
                self.show(self.time(), &state);
            }
            return Ok(true);
        }
        self.accept(&trial);
        let mut slope = [0.0; N];
        slope[..M].copy_from_slice(&trial.attempt.end_slope);
        self.slope = Some(slope);
        self.elapsed = if h == remaining { stop } else { self.elapsed + h };
        Ok(false)
    }

    fn attempt<const M: usize>(&mut self, slope: &[f64; M], h: f64) -> Trial<M> {
        self.work.derivatives += STAGES;
        let start = part(&self.state);
        step(&self.flow.machine, self.time(), &start, slope, h, &part(&self.tolerance))
    }

    /// Makes the end of an attempt the state.
    fn accept<const M: usize>(&mut self, trial: &Trial<M>) {
        if self.probe.resolution().is_some() || self.filters.is_some() || self.link_filter.is_some() {
            let (begin, h, whole) = (self.time(), trial.attempt.h, self.state);
            let at = |x: f64| {
                let mut state = whole;
                let changed = if x == 1.0 { trial.attempt.end } else { trial.attempt.dense(x) };
                state[..M].copy_from_slice(&changed);
                state
            };
            self.watch(begin, h, at);
            self.filter(begin, h, at);
        }
        self.state[..M].copy_from_slice(&trial.attempt.end);
        self.here = Some(trial.end.operating);
        self.work.steps += 1;
        if M > PLANE {
            self.moved = self.moved.max((self.state[2] - self.case.start_angle).abs());
        }
        let current = trial.end.operating.port.current;
        self.peak_current = current.iter().fold(self.peak_current, |peak, i| peak.max(i.abs()));
    }

    /// Shows who watches a step of `h` seconds with the state at shares of it, and the gate edges on the way.
    fn watch(&mut self, begin: f64, h: f64, at: impl Fn(f64) -> [f64; N]) {
        let Some(resolution) = self.probe.resolution() else { return };
        // A number of snapshots per step is small and positive.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let parts = (h / resolution).ceil().max(1.0) as u32;
        for part in 1..=parts {
            let x = f64::from(part) / f64::from(parts);
            // What changes the flow waits for the step's end, wherever rounding puts that.
            while let Some((edge, due)) = self.deferred.waiting().first()
                && !matches!(due, Due::Gate(leg, gate) if self.matters(*leg, *gate))
                && (*edge - self.reached).seconds() < self.elapsed + x * h
                && let Some((edge, due)) = self.deferred.take()
            {
                let share = ((edge.seconds() - begin) / h).clamp(0.0, 1.0);
                self.show(edge.seconds(), &at(share));
                self.carry_at(edge.seconds(), due);
            }
            self.show(begin + x * h, &at(x));
        }
    }

    /// Carries the sensors' filters over a step of `h` seconds with the state at shares of it.
    fn filter(&mut self, begin: f64, h: f64, at: impl Fn(f64) -> [f64; N]) {
        if self.filters.is_none() && self.link_filter.is_none() || h <= 0.0 {
            return;
        }
        let points =
            [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|x| self.flow.operating(begin + x * h, &at(x)).port);
        if let Some(filters) = &mut self.filters {
            let (settings, modes) = (self.case.sensors.settings, self.flow.modes());
            let seen = points.map(|port| settings.seen(port.current, modes));
            for (k, filter) in filters.iter_mut().enumerate() {
                filter.advance(h, seen.map(|current| current[k]));
            }
        }
        if let Some(filter) = &mut self.link_filter {
            filter.advance(h, points.map(|port| port.dc_link));
        }
    }
}

/// The first `M` numbers of a state.
fn part<const M: usize, const N: usize>(whole: &[f64; N]) -> [f64; M] {
    std::array::from_fn(|n| whole[n])
}
