//! From one instant to the next: steps, and what is carried along with them.

use standstill_interface::{Nanos, Phase};
use standstill_inverter::{Conduction, Gate, Port};

use super::Rig;
use super::deferred::Due;
use crate::case::RunError;
use crate::flow::Flow;
use crate::integrator::{STAGES, next_length};
use crate::lanes::{Steps, turn};
use crate::machine::{CORE, PLANE};
use crate::stride::{Ask, Stride};
use crate::trace::{Event, Probe};

/// Events within one segment beyond which the modes are taken to chatter. A segment of a PWM period has at most
/// a handful.
const MOST_EVENTS: u32 = 1000;

/// From the last instant to the one at hand.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Span {
    /// In s.
    length: f64,
    /// Where the step at hand ends at the latest, in s since the last instant.
    stop: f64,
    /// What ended within the step at hand, and how long it is until then, in s.
    cut: Option<(usize, f64)>,
    /// Events so far.
    events: u32,
}

impl<const N: usize, P: Probe, S: Steps> Rig<'_, N, P, S> {
    /// Time in s since the start of the run.
    pub(super) fn time(&self) -> f64 {
        self.reached.seconds() + self.elapsed
    }

    /// The machine at the state, as the bridge sees it.
    pub(super) fn here(&mut self) -> Port {
        if let Some(here) = &mut self.here {
            if self.waited {
                // While nothing happened, only the link's voltage changed.
                here.dc_link = self
                    .flow
                    .machine
                    .link
                    .source_at(self.reached.seconds() + self.elapsed, self.flow.machine.ripple_phase);
                self.waited = false;
            }
            return *here;
        }
        self.waited = false;
        let here = self.flow.machine.port(&self.flow.operating(self.time(), &self.state));
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

    /// Whether the flow is at the instant at hand; else it must be carried there. What waits for this instant is carried out.
    pub(super) fn is_there(&mut self) -> bool {
        let there = self.reached == self.now;
        if there {
            self.carry_all();
        }
        there
    }

    /// Carries the flow to the instant at hand.
    pub(super) async fn catch_up(&mut self) -> Result<(), RunError> {
        self.begin_span();
        while let Some(h) = self.next_step()? {
            if N == CORE && !self.flow.motion().moves() && self.flow.machine.link.storage.is_none() {
                // Nothing but the flux changes.
                if !self.try_step::<PLANE>(h)? {
                    turn().await;
                    self.finish_step(h, &self.steps.answer::<PLANE>())?;
                }
            } else if !self.try_step::<N>(h)? {
                turn().await;
                self.finish_step(h, &self.steps.answer::<N>())?;
            }
        }
        self.carry_all();
        self.reached = self.now;
        self.elapsed = 0.0;
        Ok(())
    }

    /// Sets out for the instant at hand.
    fn begin_span(&mut self) {
        self.elapsed = 0.0;
        self.span = Span { length: (self.now - self.reached).seconds(), ..Span::default() };
        if self.span.length > 0.0 {
            self.work.segments += 1;
            if self.probe.resolution().is_some() {
                let state = self.state;
                self.show(self.time(), &state);
            }
        }
    }

    /// The length in s of the next step that is to be tried; none at the instant at hand.
    fn next_step(&mut self) -> Result<Option<f64>, RunError> {
        if let Some((_, h)) = self.span.cut {
            return Ok(Some(h));
        }
        while self.elapsed < self.span.length {
            self.span.stop = if self.span.events == 0 {
                self.span.length
            } else {
                self.next_that_matters(self.span.length)?
            };
            let remaining = self.span.stop - self.elapsed;
            if remaining <= 0.0 {
                continue;
            }
            if !self.rests() {
                return Ok(Some(remaining.min(self.step_hint).min(self.longest_step)));
            }
            self.wait(self.span.stop);
        }
        Ok(None)
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
            self.resolve()?;
        }
        Ok(stop.min(span))
    }

    /// Carries out all changes that waited.
    fn carry_all(&mut self) {
        while let Some((at, due)) = self.deferred.take() {
            self.carry_at(at, due);
        }
    }

    /// Carries out the changes that waited for up to `elapsed` seconds since the last instant.
    fn carry_until(&mut self, elapsed: f64) {
        while let Some((at, _)) = self.deferred.waiting().first()
            && (*at - self.reached).seconds() <= elapsed
            && let Some((at, due)) = self.deferred.take()
        {
            self.carry_at(at, due);
        }
    }

    /// Carries out a change of the instant at hand.
    pub(super) fn carry(&mut self, due: Due) {
        self.carry_at(self.now, due);
    }

    #[inline]
    fn carry_at(&mut self, at: Nanos, due: Due) {
        let event = match due {
            Due::Command => Event::Command,
            Due::Gate(leg, gate) => {
                self.flow.gates[leg] = gate;
                Event::Gate(Phase::ALL[leg], gate)
            }
        };
        self.probe.event(at.seconds(), event);
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
        self.waited = true;
        self.elapsed = elapsed;
    }

    /// What follows from a step of `h` seconds: it is taken, tried again shorter, or cut where something ended within it.
    fn finish_step<const M: usize>(&mut self, h: f64, stride: &Stride<M>) -> Result<(), RunError> {
        let stop = self.span.stop;
        if let Some((which, _)) = self.span.cut.take() {
            self.accept(h, stride);
            // A cut of no length still ends the mode that it was to end.
            self.elapsed = (self.elapsed + h).min(stop);
            self.carry_until(self.elapsed);
            self.work.events += 1;
            self.handle_event(which)?;
            if self.probe.resolution().is_some() {
                let state = self.state;
                self.show(self.time(), &state);
            }
            self.span.events += 1;
            return if self.span.events > MOST_EVENTS { Err(RunError::Chatter) } else { Ok(()) };
        }
        let error = stride.error;
        if error <= 1.0 {
            // A step cut short by the end of the span says little about the next one's length.
            let next = next_length(h, error);
            self.step_hint = if h < self.step_hint { next.max(self.step_hint) } else { next };
        } else if h < 1e-15 {
            return Err(RunError::NotFinite);
        } else {
            self.step_hint = next_length(h, error).min(0.9 * h);
            return Ok(());
        }
        if stride.margin < 0.0
            && let Some((which, share)) = self.first_zero(h, stride).or_else(|| self.find_event::<M>(h))
        {
            self.span.cut = Some((which, h * share));
            return Ok(());
        }
        self.accept(h, stride);
        self.elapsed = if h == stop - self.elapsed { stop } else { self.elapsed + h };
        Ok(())
    }

    /// Tries a step of `h` seconds from the state; false if it must be waited for.
    fn try_step<const M: usize>(&mut self, h: f64) -> Result<bool, RunError> {
        // Those of the step and the one in its middle.
        self.work.derivatives += STAGES as u64 + 1;
        match self.steps.ask(&self.ask::<M>(h), &part(&self.tolerance)) {
            Some(stride) => self.finish_step(h, &stride).map(|()| true),
            None => Ok(false),
        }
    }

    pub(super) fn ask<const M: usize>(&self, h: f64) -> Ask<'_, M> {
        let Flow { machine, limits, .. } = &self.flow;
        Ask { machine, limits, time: self.time(), start: part(&self.state), h }
    }

    /// Makes the end of a step of `h` seconds the state.
    fn accept<const M: usize>(&mut self, h: f64, stride: &Stride<M>) {
        if self.probe.resolution().is_some() || self.filters.is_some() || self.link_filter.is_some() {
            let (begin, whole) = (self.time(), self.state);
            let attempt = self.ask::<M>(h).attempt(&self.flow.machine.terminals());
            let at = |x: f64| {
                let mut state = whole;
                let changed = if x == 1.0 { stride.end } else { attempt.dense(x) };
                state[..M].copy_from_slice(&changed);
                state
            };
            self.watch(begin, h, at);
            self.filter(begin, h, at);
        }
        self.state[..M].copy_from_slice(&stride.end);
        self.here = Some(stride.port);
        self.waited = false;
        self.work.steps += 1;
        if M > PLANE {
            self.moved = self.moved.max((self.state[2] - self.case.start_angle).abs());
        }
        self.peak_current = stride.port.current.iter().fold(self.peak_current, |peak, i| peak.max(i.abs()));
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
                self.carry_at(edge, due);
            }
            self.show(begin + x * h, &at(x));
        }
    }

    /// Carries the sensors' filters over a step of `h` seconds with the state at shares of it.
    fn filter(&mut self, begin: f64, h: f64, at: impl Fn(f64) -> [f64; N]) {
        if self.filters.is_none() && self.link_filter.is_none() || h <= 0.0 {
            return;
        }
        // A filter takes a cubic through four points: too few for a ripple of which a long step has several periods.
        let link = self.flow.machine.link;
        let ripples = self.link_filter.is_some() && link.ripple != 0.0;
        let parts = if ripples { (8.0 * h * link.ripple_frequency).ceil().max(1.0) } else { 1.0 };
        let mut part = 0.0;
        while part < parts {
            self.filter_part(begin, h, [part / parts, (part + 1.0) / parts], &at);
            part += 1.0;
        }
    }

    /// The same over a part of it, between two shares.
    fn filter_part(&mut self, begin: f64, whole: f64, [from, to]: [f64; 2], at: &impl Fn(f64) -> [f64; N]) {
        let h = whole * (to - from);
        let points = [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|share| {
            let (machine, x) = (&self.flow.machine, from + (to - from) * share);
            machine.port(&machine.operating(begin + x * whole, &at(x)))
        });
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
