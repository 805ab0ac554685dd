//! Energy balance of a run.

use serde::Serialize;

use crate::control::{Joined, Settled};

/// Energies transferred since the start of the run, in J.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ledger {
    /// Energy delivered by the DC source.
    pub source: f64,
    /// Energy lost in the source's resistance.
    pub source_loss: f64,
    /// Energy lost in switches and diodes, and in the arcs of wires that break.
    pub device_loss: f64,
    /// Energy lost in the winding's resistance, including the loss of the winding's ringing with the terminals, and the heat in
    /// the resistance R_f of shorted turns.
    pub copper_loss: f64,
    /// Energy lost in the dividers of terminals with a capacitance.
    pub divider_loss: f64,
    /// Energy lost in eddy currents.
    pub eddy_loss: f64,
    /// Energy lost by hysteresis, while play cells of the stator's iron slide.
    pub hysteresis_loss: f64,
    /// Work of the electromagnetic torque, cogging included, on the rotor.
    pub shaft_work: f64,
    /// Part of the shaft work lost in friction.
    pub friction_loss: f64,
    /// Part of the shaft work done on the load.
    pub load_work: f64,
    /// Part of the shaft work lost in impacts of the rotor at the ends of the brake's play.
    pub impact_loss: f64,
    /// Change of the energy in the link's capacitor.
    pub link_change: f64,
    /// Change of the energy in the terminals' capacitances.
    pub terminal_change: f64,
    /// Change of the magnetic field's energy, including the energies of eddy currents, play cells and cogging.
    pub field_change: f64,
    /// Change of the rotor's kinetic energy.
    pub kinetic_change: f64,
}

impl Ledger {
    /// Adds another balance, multiplied by a factor, to this one.
    pub(crate) fn add(&mut self, of: &Self, times: f64) {
        macro_rules! each {
            ($($account:ident)*) => {{
                // A field that is missing in the list below is a compile error here.
                let Self { $($account),* } = self;
                $(*$account += times * of.$account;)*
            }};
        }
        each!(
            source source_loss device_loss copper_loss divider_loss eddy_loss hysteresis_loss shaft_work
            friction_loss load_work impact_loss link_change terminal_change field_change
            kinetic_change
        );
    }

    /// Accounts for a device that charged the capacitance of a terminal. The source gave the energy `given` in J through the device's
    /// rail; the capacitance stored `kept` in J of it, and the device lost the rest.
    pub(crate) fn charge(&mut self, given: f64, kept: f64) {
        self.source += given;
        self.device_loss += given - kept;
    }

    /// Accounts for terminals, each with this capacitance in F, that devices charged at one instant. The energy comes from the link's
    /// capacitor if there is one, else from the source.
    pub(crate) fn join(&mut self, before: &Joined, after: &Settled, capacitance: f64) {
        for (k, (to, from)) in after.potential.into_iter().zip(before.potential).enumerate() {
            let charge = capacitance * (to - from);
            let given = if after.upper[k] { charge * (before.link + after.link) / 2.0 } else { 0.0 };
            self.source += if before.share == 0.0 { given } else { 0.0 };
            self.device_loss += given - charge * (to + from) / 2.0;
        }
    }

    /// Returns the energy in J from the source that is missing in all accounts: zero, apart from the integrator's
    /// error.
    ///
    /// ```
    /// use standstill_sim::Ledger;
    ///
    /// // What the source gave is heat in copper and energy of the field.
    /// let ledger = Ledger { source: 3.0, copper_loss: 1.0, field_change: 2.0, ..Ledger::default() };
    /// assert_eq!(ledger.imbalance(), 0.0);
    /// ```
    pub fn imbalance(&self) -> f64 {
        self.source
            - self.source_loss
            - self.device_loss
            - self.copper_loss
            - self.divider_loss
            - self.eddy_loss
            - self.hysteresis_loss
            - self.shaft_work
            - self.link_change
            - self.terminal_change
            - self.field_change
    }

    /// Returns the shaft work in J that is missing in all mechanical accounts: zero, apart from the integrator's error.
    pub fn mechanical_imbalance(&self) -> f64 {
        self.shaft_work - self.friction_loss - self.load_work - self.impact_loss - self.kinetic_change
    }
}
