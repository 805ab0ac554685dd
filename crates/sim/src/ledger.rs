//! Accounts of energy.

/// Where the energy went, in J since the start of the run.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ledger {
    /// Delivered by the DC source.
    pub source: f64,
    /// Lost in the source's resistance.
    pub source_loss: f64,
    /// Lost in switches and diodes.
    pub device_loss: f64,
    /// Lost in the winding, by what rings with the terminals, too.
    pub copper_loss: f64,
    /// Lost in eddy currents.
    pub eddy_loss: f64,
    /// Lost where cells of the stator's iron slide.
    pub hysteresis_loss: f64,
    /// Work of the electromagnetic torque, cogging included, on the rotor.
    pub shaft_work: f64,
    /// Of that, lost in friction.
    pub friction_loss: f64,
    /// Of that, done on the load.
    pub load_work: f64,
    /// Of that, lost where the rotor ran into the end of the brake's play.
    pub impact_loss: f64,
    /// Change of the energy in the link's capacitor.
    pub link_change: f64,
    /// Change of the energy in the terminals' capacitances.
    pub terminal_change: f64,
    /// Change of the magnetic field's energy, with what eddy currents, the cells of the iron and cogging store.
    pub field_change: f64,
    /// Change of the rotor's kinetic energy.
    pub kinetic_change: f64,
}

impl Ledger {
    /// Adds accounts, times a factor.
    pub(crate) fn add(&mut self, of: &Self, times: f64) {
        self.source += times * of.source;
        self.source_loss += times * of.source_loss;
        self.device_loss += times * of.device_loss;
        self.copper_loss += times * of.copper_loss;
        self.eddy_loss += times * of.eddy_loss;
        self.hysteresis_loss += times * of.hysteresis_loss;
        self.shaft_work += times * of.shaft_work;
        self.friction_loss += times * of.friction_loss;
        self.load_work += times * of.load_work;
        self.impact_loss += times * of.impact_loss;
        self.link_change += times * of.link_change;
        self.terminal_change += times * of.terminal_change;
        self.field_change += times * of.field_change;
        self.kinetic_change += times * of.kinetic_change;
    }

    /// A device charged a terminal at once: the rail gave some energy in J, of a `stiff` source or of the link's capacitor, and the
    /// terminal has some of it.
    pub(crate) fn charge(&mut self, given: f64, kept: f64, stiff: bool) {
        self.source += if stiff { given } else { 0.0 };
        self.device_loss += given - kept;
    }

    /// Energy that the source delivered and no account shows: zero but for the integrator's error.
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
            - self.eddy_loss
            - self.hysteresis_loss
            - self.shaft_work
            - self.link_change
            - self.terminal_change
            - self.field_change
    }

    /// Shaft work that no mechanical account shows.
    pub fn mechanical_imbalance(&self) -> f64 {
        self.shaft_work - self.friction_loss - self.load_work - self.impact_loss - self.kinetic_change
    }
}
