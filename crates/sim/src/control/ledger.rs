//! Where a run's energy goes, integrated along its steps.

use standstill_interface::Dq;
use standstill_inverter::Storage;
use standstill_numeric::{Heading, Wide};

use super::conduction::One;
use super::run::Control;
use crate::lanes::bank::Bank;
use crate::ledger::Ledger;
use crate::physics::plane::Plane;
use crate::step::hermite::Cubic;
use crate::step::two_derivative::Here;

/// Shares and weights of Gauss and Legendre's rule with four points over 0 to 1.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// The accounts of a run that goes on.
#[derive(Clone, Debug)]
pub struct Accounts {
    spent: Ledger,
    field: f64,
    link: f64,
    terminals: f64,
}

impl Accounts {
    /// At the start of a run.
    pub fn open<V: Wide>(control: &Control<'_>, bank: &Bank<'_, V>) -> Self {
        Self {
            spent: Ledger::default(),
            field: field_energy(control, bank),
            link: link_energy(control, &bank.here),
            terminals: terminal_energy(control, &bank.here),
        }
    }

    /// A device charged a terminal at once: the rail gave some energy in J, of a stiff source or of the link's capacitor, and the
    /// terminal has some of it.
    pub fn charge(&mut self, given: f64, kept: f64, stiff: bool) {
        self.spent.source += if stiff { given } else { 0.0 };
        self.spent.device_loss += given - kept;
    }

    /// Adds what was spent in the step just accepted.
    pub fn follow<'a, V: Wide>(&mut self, control: &Control<'a>, bank: &Bank<'a, V>) {
        let h = bank.tried.h.get(control.lane);
        if h <= 0.0 {
            return;
        }
        // So many parts that nothing turns by more than a radian in any.
        let turned = bank.tried.floating.as_ref().map_or(0.0, |floating| {
            floating.ringing.turned.iter().map(|square| square.get(control.lane)).fold(0.0, f64::max)
        });
        let parts = turned.sqrt().ceil().max(1.0);
        let mut part = 0.0;
        while part < parts {
            for (share, weight) in GAUSS {
                let share = (part + share) / parts;
                let there = bank.within(share);
                let mut powers = powers(control, bank, &there);
                powers.hysteresis_loss = hysteresis_loss(bank, control.lane, &there, share);
                self.spend(&powers, weight * h / parts);
            }
            part += 1.0;
        }
        self.follow_terminals(control, bank);
    }

    /// Adds powers in W that last for a time in s.
    fn spend(&mut self, powers: &Ledger, time: f64) {
        let spent = &mut self.spent;
        spent.source += time * powers.source;
        spent.source_loss += time * powers.source_loss;
        spent.device_loss += time * powers.device_loss;
        spent.copper_loss += time * powers.copper_loss;
        spent.eddy_loss += time * powers.eddy_loss;
        spent.hysteresis_loss += time * powers.hysteresis_loss;
        spent.shaft_work += time * powers.shaft_work;
        spent.friction_loss += time * powers.friction_loss;
        spent.load_work += time * powers.load_work;
    }

    /// What follows a device's potential is charged through it, by currents too small to count but for their energy.
    fn follow_terminals<V: Wide>(&mut self, control: &Control<'_>, bank: &Bank<'_, V>) {
        let capacitance = control.case.inverter.bridge.terminal_capacitance;
        if capacitance == 0.0 {
            return;
        }
        let lane = control.lane;
        let link = (bank.begin.state.link.get(lane) + bank.tried.end.state.link.get(lane)) / 2.0;
        for (k, leg) in bank.tried.legs.leg.iter().enumerate() {
            if leg.direction.get(lane) != 0.0 {
                let [from, to] = [&bank.begin, &bank.tried.end].map(|here| here.state.potential[k].get(lane));
                let charge = capacitance * (to - from);
                self.charge(charge * leg.rail.get(lane) * link, charge * (to + from) / 2.0, true);
            }
        }
    }

    /// At its end.
    pub fn close<'a, V: Wide>(self, control: &Control<'a>, bank: &Bank<'a, V>) -> Ledger {
        Ledger {
            impact_loss: control.impact_loss,
            field_change: field_energy(control, bank) - self.field,
            link_change: link_energy(control, &bank.here) - self.link,
            terminal_change: terminal_energy(control, &bank.here) - self.terminals,
            kinetic_change: control.kinetic_energy(bank),
            ..self.spent
        }
    }
}

/// Power in W in each account of [`Ledger`].
fn powers<'a, V: Wide>(control: &Control<'a>, bank: &Bank<'a, V>, here: &Here<V>) -> Ledger {
    let lane = control.lane;
    let one = |pack: &V| pack.get(lane);
    let motor = control.case.motor;
    let current = control.currents_at(bank, here);
    let legs = &bank.tried.legs.leg;
    let taken: f64 = (0..3).map(|k| one(&legs[k].rail) * current[k]).sum();
    let source = bank.machine.links.source_of(lane, one(&here.time) * 1e-9).voltage;
    let (mut source_current, mut source_loss) = (taken, 0.0);
    if let Some(Storage { source_resistance, .. }) = control.case.inverter.link.storage {
        source_current = (source - one(&here.state.link)) / source_resistance;
        source_loss = source_current * source_current * source_resistance;
    }
    // A conducting leg's drop is −offset + resistance · i. One in which no device conducts carries nothing, or charges its terminal
    // through what the winding resists it with.
    let drop = |k: usize| (one(&legs[k].resistance) * current[k] - one(&legs[k].offset)) * current[k];
    let i = One::of(bank, here, lane).current;
    let ringing = control.case.inverter.bridge.terminal_resistance;
    let floating = (0..3).filter(|k| one(&legs[*k].direction) == 0.0).map(|k| current[k] * current[k]);
    let mut powers = Ledger {
        source: source * source_current,
        source_loss,
        device_loss: (0..3).map(drop).sum(),
        copper_loss: 1.5 * motor.resistance * i.dot(i) + ringing * floating.sum::<f64>(),
        ..Ledger::default()
    };
    if let Some(eddy) = motor.magnetics.eddy(lag(here, lane)) {
        powers.eddy_loss = 1.5 * eddy.current.dot(lag(here, lane)) / eddy.time_constant;
    }
    if let Some(rotors) = &bank.machine.rotors {
        let speed = one(&here.state.speed) / f64::from(motor.pole_pairs);
        powers.shaft_work = one(&here.at.torque) * speed;
        powers.friction_loss = control.motion.friction(&motor.rotor, speed) * speed;
        powers.load_work = one(&rotors.load) * speed;
    }
    powers
}

fn lag<V: Wide>(here: &Here<V>, lane: usize) -> Dq<f64> {
    Dq::new(here.at.lag.d.get(lane), here.at.lag.q.get(lane))
}

/// What cells of the iron turn into heat in W at a share of the step just accepted.
fn hysteresis_loss<V: Wide>(bank: &Bank<'_, V>, lane: usize, there: &Here<V>, share: f64) -> f64 {
    let Some(cells) = &bank.begin_cells else { return 0.0 };
    let (tried, from, to) = (&bank.tried, bank.begin.state.flux, bank.tried.end.state.flux);
    let (h, share) = (tried.h, V::of(share));
    let [first, last] = tried.change.map(|change| change.flux * h);
    let rise = |value: [V; 2], slope: [V; 2]| Cubic { value, slope }.rise(share) / h;
    let rise = Plane::new(rise([from.x, to.x], [first.x, last.x]), rise([from.y, to.y], [first.y, last.y]));
    let away = cells.away_at(there.state.flux, Some(first * share));
    1.5 * cells.loss(lane, &away, rise)
}

/// Energy of the field in J.
fn field_energy<V: Wide>(control: &Control<'_>, bank: &Bank<'_, V>) -> f64 {
    let (lane, here) = (control.lane, &bank.here);
    let cells = bank.machine.cells.as_ref().map_or(0.0, |cells| cells.energy(lane, here.state.flux));
    let state = &here.state;
    let turned = state.turned.get(lane);
    let flux = Plane::new(state.flux.x.get(lane), state.flux.y.get(lane)).to_rotor(Heading::of(turned));
    let lag = flux - Dq::new(state.lagging.d.get(lane), state.lagging.q.get(lane));
    control.case.motor.field_energy(flux, lag, control.case.start_angle + turned) + 1.5 * cells
}

/// Energy in the terminals' capacitances in J.
fn terminal_energy<V: Wide>(control: &Control<'_>, here: &Here<V>) -> f64 {
    let squares: f64 = here.state.potential.iter().map(|v| v.get(control.lane) * v.get(control.lane)).sum();
    control.case.inverter.bridge.terminal_capacitance * squares / 2.0
}

/// Energy in the link's capacitor in J.
fn link_energy<V: Wide>(control: &Control<'_>, here: &Here<V>) -> f64 {
    let voltage = here.state.link.get(control.lane);
    control.case.inverter.link.storage.map_or(0.0, |storage| storage.capacitance * voltage * voltage / 2.0)
}
