//! The energy balance of a run, integrated along its steps.

use standstill_numeric::Wide;

use super::run::Control;
use crate::effect::{Effect, Moment, each_effect};
use crate::lanes::bank::Bank;
use crate::ledger::Ledger;
use crate::step::two_derivative::Here;

/// Abscissas and weights of Gauss–Legendre quadrature with four points over 0 to 1.
const GAUSS: [(f64, f64); 4] = [
    (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
    (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
    (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
    (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
];

/// Energy balance of a run that is not over.
#[derive(Clone, Debug)]
pub struct Accounts {
    /// Energies in J transferred since the start of the run.
    pub spent: Ledger,
    /// Energies in J that were stored at the start.
    stored: Ledger,
}

impl Accounts {
    /// Opens the balance at the start of a run: notes the stored energies.
    pub fn open<'a, V: Wide>(control: &Control<'a>, bank: &Bank<'a, V>) -> Self {
        Self { spent: Ledger::default(), stored: control.moment(bank, &bank.here).energies() }
    }

    /// Adds the energies spent in the step just accepted.
    pub fn follow<'a, V: Wide>(&mut self, control: &Control<'a>, bank: &Bank<'a, V>) {
        let tried = &bank.outcome.tried;
        let h = tried.h.get(control.lane);
        if h <= 0.0 {
            return;
        }
        // The step is divided into parts in which neither an oscillation of the terminals nor the cogging torque's phase advances by more
        // than a radian. (Cogging does not shorten the steps of a driven rotor.)
        let [begin, end] = [&bank.outcome.begin, &tried.end].map(|at| at.state.turned.get(control.lane));
        let periods = control.case.motor.rotor.cogging.map_or(0.0, |cogging| f64::from(cogging.periods));
        let parts = tried.turned(control.lane).max(periods * (end - begin).abs()).ceil().max(1.0);
        let mut part = 0.0;
        while part < parts {
            for (share, weight) in GAUSS {
                let span = bank.span((part + share) / parts);
                let powers = control.moment(bank, &bank.within((part + share) / parts)).powers(&span);
                self.spent.add(&powers, weight * h / parts);
            }
            part += 1.0;
        }
        let (moment, span) = (control.moment(bank, &bank.here), bank.span(1.0));
        each_effect!(moment.machine, span.branch, effect => effect.work(&moment, &span, &mut self.spent));
    }

    /// Closes the balance at the end of a run: adds the changes of stored energies.
    pub fn close<'a, V: Wide>(mut self, control: &Control<'a>, bank: &Bank<'a, V>) -> Ledger {
        self.spent.add(&control.moment(bank, &bank.here).energies(), 1.0);
        self.spent.add(&self.stored, -1.0);
        self.spent
    }
}

impl<'a> Control<'a> {
    /// Returns the state of this run's machine at `here`, from which its powers and stored energies are computed.
    pub(super) fn moment<'s, V: Wide>(
        &'s self,
        bank: &'s Bank<'a, V>,
        here: &'s Here<V>,
    ) -> Moment<'s, 'a, V> {
        Moment { case: &self.case, motion: self.motion, machine: &bank.machine, lane: self.lane, here }
    }
}
