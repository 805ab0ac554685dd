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
    /// Energy lost in switches, in diodes, and in the arcs of breaking wires.
    pub device_loss: f64,
    /// Energy lost in the winding's resistance and in the resistance R_f of shorted turns. It includes the losses of oscillations between
    /// winding and terminal capacitances.
    pub copper_loss: f64,
    /// Energy lost in the dividers of terminals with a capacitance.
    pub divider_loss: f64,
    /// Energy lost in eddy currents.
    pub eddy_loss: f64,
    /// Energy lost by hysteresis in the stator's iron, that is, by sliding play cells.
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
    /// Adds to this balance another one, `of`, multiplied by the factor `times`.
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
    /// rail. The capacitance stored the part `kept` in J, and the device lost the rest.
    pub(crate) fn charge(&mut self, given: f64, kept: f64) {
        self.source += given;
        self.device_loss += given - kept;
    }

    /// Accounts for devices that charged terminals at one instant. `capacitance` is the capacitance of each terminal in F. The energy
    /// comes from the link's capacitor, or from the source if the link has no capacitor.
    pub(crate) fn join(&mut self, before: &Joined, after: &Settled, capacitance: f64) {
        for (k, (to, from)) in after.potential.into_iter().zip(before.potential).enumerate() {
            let charge = capacitance * (to - from);
            let given = if after.upper[k] { charge * (before.link + after.link) / 2.0 } else { 0.0 };
            self.source += if before.share == 0.0 { given } else { 0.0 };
            self.device_loss += given - charge * (to + from) / 2.0;
        }
    }

    /// Returns the energy in J that the source delivered and that appears in no other account. It is zero apart from the integrator's
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

    /// Returns the shaft work in J that appears in no other mechanical account. It is zero apart from the integrator's error.
    pub fn mechanical_imbalance(&self) -> f64 {
        self.shaft_work - self.friction_loss - self.load_work - self.impact_loss - self.kinetic_change
    }
}
