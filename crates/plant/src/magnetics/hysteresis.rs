//! Hysteresis of the stator's iron: pulses leave a memory, and opposite pulses do not cancel exactly.
//!
//! The iron of teeth and yoke is in series with air gap and rotor: what drives the flux through it adds to the current that the
//! core takes. This magnetomotive force is split into cells. Each has an elastic flux and a pinned one, π, which moves only
//! while the force on it reaches its threshold κ, and then along the force:
//! ```text
//!   i = ∂W/∂ψ + Σ K_k (ψ − π_k),   |ψ − π_k| ≤ r_k = κ_k / K_k
//! ```
//! π is the vector play of ψ: it follows like a weight on a string of length r. (Bergqvist 1997, doi 10.1016/S0921-4526(97)00319-0;
//! Henrotte, Nicolet, Hameyer 2006, doi 10.1108/03321640610634344; François-Lavet et al. 2013, doi 10.1016/j.cam.2012.09.033. They
//! take the field as given and ask for the flux; here the flux is the state, so the cells are in series, not in parallel.) Stored
//! are `3/2 · ½ K |ψ − π|²`, lost `3/2 κ |dπ| ≥ 0`: whatever the parameters, no energy is created; minor loops close; and without
//! thresholds what is left is the core alone.
//!
//! The cells stand in the stator's frame: it is the stator's iron whose flux turns in operation and reverses under pulses.
//! They know no direction, so that while the rotor stands they are the same in its frame. A rotor that turns drags the stator's
//! memory along and feels it as a torque. Rotor iron, whose flux hardly changes in operation, is taken to follow its curve.

/// Cells that a motor may have.
pub const MOST_CELLS: usize = 3;

/// Hysteresis of a stator's iron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hysteresis {
    /// Peak current in A that a coercive field strength in the iron amounts to: Σ κ, what stays of the cells' force after a large
    /// change of the flux.
    pub coercive_current: f64,
    /// Share of the smaller of L_d and L_q, without current, that a pulse does not meet which is too small to move anything
    /// pinned: what the iron's initial permeability makes of it. Above 0, below 1.
    pub depth: f64,
    /// How many cells, 1 to [`MOST_CELLS`].
    pub cells: u8,
}

/// One cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// K in 1/H; 0: there is none.
    pub stiffness: f64,
    /// r in Wb.
    pub reach: f64,
}

impl Hysteresis {
    /// Its cells, over the smaller incremental inductance in H at no current. They are equally stiff and reach (2 k − 1)/n of
    /// the mean reach: as many as give, by the midpoint rule, Rayleigh's law, with a loss of the cube of a small amplitude.
    ///
    /// ```
    /// use standstill_plant::Hysteresis;
    ///
    /// let cells = Hysteresis { coercive_current: 0.08, depth: 0.05, cells: 3 }.cells_of(10e-3);
    /// let coercive: f64 = cells.iter().map(|cell| cell.stiffness * cell.reach).sum();
    /// assert!((coercive - 0.08).abs() < 1e-15);
    /// let stiffness: f64 = cells.iter().map(|cell| cell.stiffness).sum();
    /// assert!((1.0 / (1.0 / 10e-3 + stiffness) - 0.95 * 10e-3).abs() < 1e-15);
    /// ```
    pub fn cells_of(&self, inductance: f64) -> [Cell; MOST_CELLS] {
        let n = f64::from(self.cells);
        let stiffness = self.depth / ((1.0 - self.depth) * inductance);
        let mean_reach = self.coercive_current / stiffness;
        std::array::from_fn(|k| {
            let k = k as f64;
            if k < n {
                Cell { stiffness: stiffness / n, reach: mean_reach * (2.0 * k + 1.0) / n }
            } else {
                Cell::default()
            }
        })
    }
}
