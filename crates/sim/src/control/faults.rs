//! Changes of a run at the instants at which a part breaks or works again.

use standstill_interface::{Abc, Command, Leg, Stage};
use standstill_inverter::AXES;
use standstill_numeric::{Heading, Wide};

use super::conduction::NO_CURRENT;
use super::run::Control;
use crate::Broken;
use crate::case::RunError;
use crate::effect::play::Before;
use crate::lanes::bank::Bank;
use crate::physics::plane::Plane;
use crate::trace::{ComparatorState, Event};

impl<'a> Control<'a> {
    /// Applies the faults that begin or end at a time in ns.
    pub(super) fn change_faults<V: Wide>(
        &mut self,
        bank: &mut Bank<'a, V>,
        time: f64,
    ) -> Result<(), RunError> {
        let (lane, faults) = (self.lane, self.case.faults);
        self.breaks = faults.next(time);
        for (broken, health) in faults.changes(time).filter(|_| time > 0.0) {
            self.event(time * 1e-9, Event::Fault(broken, health));
        }
        let deaf = faults.at(time).any(|broken| broken == Broken::Deaf);
        let blanked = self.comparators.as_ref().is_some_and(|of| of.state() == ComparatorState::Blanked);
        if std::mem::replace(&mut self.deaf, deaf) != deaf && !blanked {
            self.put_levels(bank);
        }
        let legs = &mut bank.machine.legs;
        legs.put_contacts(lane, faults.contacts(time));
        if let (Some(shorted), Some((phase, short))) = (&mut bank.machine.shorted, faults.short(time))
            && !shorted.is_there(lane)
        {
            let start = Heading::of(self.case.start_angle);
            let flux = bank.here.state.flux.get(lane);
            let lagging =
                shorted.put(lane, self.case.motor, &short, Plane::from_stator(AXES[phase], start), flux);
            bank.here.state.shorted.put(lane, lagging);
            bank.look(lane);
        }
        let legs = &mut bank.machine.legs;
        for k in (0..3).filter(|k| faults.concern_gates(*k)) {
            self.sequencer.lose(legs, lane, k, faults.lost(k, time));
        }
        let (before, open) = (self.case.inverter.bridge.disconnected, faults.open(time));
        self.case.inverter.bridge.disconnected = open;
        legs.put_open(lane, &self.case.inverter.bridge);
        let least = NO_CURRENT * self.case.motor.rated_current;
        let current = self.currents(bank);
        let breaks: [bool; 3] = std::array::from_fn(|k| open[k] && !before[k] && current[k].abs() > least);
        if breaks.contains(&true) {
            // Legs without a conducting device are interrupted, too: the arc lasts longer than the oscillation of their terminals.
            let idle = |k: usize| bank.machine.legs.direction(lane, k) == 0.0;
            let ends = std::array::from_fn(|k| breaks[k] || idle(k) || current[k].abs() <= least);
            self.interrupt(bank, ends, least);
        }
        if self.stale {
            self.look_at_link(bank);
        }
        self.resolve(bank)
    }

    /// Reduces the currents of these legs to at most `least` in A, at one instant. The flux changes as by a voltage impulse at the legs'
    /// terminals, found in several Newton steps if the core saturates; play cells follow the flux on a straight path. The arc
    /// receives the energy that the field loses, less the hysteresis loss on that path.
    fn interrupt<V: Wide>(&mut self, bank: &mut Bank<'a, V>, legs: [bool; 3], least: f64) {
        // Only a machine alone has an energy balance; with this constant condition, code for wide registers contains none of it.
        let field = |control: &Self, bank: &Bank<'a, V>| {
            let kept = V::ALONE && control.accounts.is_some();
            kept.then(|| control.moment(bank, &bank.here).energies().field_change)
        };
        let lane = self.lane;
        let before = field(self, bank);
        let cells = bank.machine.branch.as_ref().map(|cells| cells.before(lane, bank.here.state.flux));
        let left = |control: &Self, bank: &Bank<'a, V>| {
            let current = control.currents(bank);
            (0..3).filter(|k| legs[*k]).fold(0.0_f64, |most, k| most.max(current[k].abs()))
        };
        let (mut most, mut lost) = (left(self, bank), 0.0);
        for _ in 0..MOST_STEPS {
            let last = bank.here.state.flux.get(lane);
            self.make_zero(bank, legs);
            lost = 1.5 * self.look_after_jump(bank, cells.as_ref());
            // Sliding cells are softer than stuck ones: a Newton step that is too long because of this is halved.
            for _ in 0..if cells.is_some() { MOST_HALVES } else { 0 } {
                if left(self, bank) < most {
                    break;
                }
                let middle = (last + bank.here.state.flux.get(lane)) * 0.5;
                bank.here.state.flux.put(lane, middle);
                lost = 1.5 * self.look_after_jump(bank, cells.as_ref());
            }
            most = left(self, bank);
            if most <= least {
                break;
            }
        }
        let after = field(self, bank);
        if let (Some(accounts), Some(before), Some(after)) = (&mut self.accounts, before, after) {
            accounts.spent.hysteresis_loss += lost;
            accounts.spent.device_loss += before - after - lost;
        }
    }

    /// Computes the machine's operating point after a jump of its flux. `before` contains the play cells before the jump. Returns the
    /// hysteresis loss of the cells in the jump, divided by 3/2, in J.
    fn look_after_jump<V: Wide>(&self, bank: &mut Bank<'a, V>, before: Option<&Before>) -> f64 {
        let (lane, flux) = (self.lane, bank.here.state.flux.get(self.lane));
        let cells = bank.machine.branch.as_mut().zip(before);
        let lost = cells.map_or(0.0, |(cells, before)| cells.leap(lane, before, flux));
        bank.look(lane);
        lost
    }
}

/// Largest number of times that a Newton step is halved.
const MOST_HALVES: u8 = 10;

/// Largest number of Newton steps that interrupt a current; a core at twice its rated current needs five.
const MOST_STEPS: u8 = 50;

/// Returns the command with its duty cycles limited to `most`.
pub(super) fn limited(command: Command<f64>, most: f64) -> Command<f64> {
    let of = |leg: Leg<f64>| if let Leg::Duty(duty) = leg { Leg::Duty(duty.min(most)) } else { leg };
    let stage = |stage: Stage<f64>| Stage { legs: Abc(stage.legs.0.map(of)), ..stage };
    Command { stage: stage(command.stage), then: command.then.map(stage), ..command }
}
