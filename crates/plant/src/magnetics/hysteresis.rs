//! Hysteresis of the stator's iron: pulses leave a memory, and opposite pulses do not cancel exactly.
//!
//! The iron of teeth and yoke is in series with air gap and rotor, so its magnetomotive force adds to the current of
//! the core. This force is the sum of the forces of cells. Each cell has an elastic flux and a pinned one, π. The
//! pinned flux moves only while the force reaches the threshold κ, in the direction of the force:
//! ```text
//!   i = ∂W/∂ψ + Σ K_k (ψ − π_k),   |ψ − π_k| ≤ r_k = κ_k / K_k
//! ```
//! π is the vector play of ψ: it follows like a weight on a string of length r. (Bergqvist 1997, doi
//! 10.1016/S0921-4526(97)00319-0; Henrotte, Nicolet, Hameyer 2006, doi 10.1108/03321640610634344; François-Lavet et al.
//! 2013, doi 10.1016/j.cam.2012.09.033. Their input is the field; here it is the flux, so the cells are in series, not
//! in parallel.) The stored energy is `3/2 · ½ K |ψ − π|²`, the loss `3/2 κ |dπ| ≥ 0`. Therefore no parameters create
//! energy, minor loops close, and cells without thresholds have no effect.
//!
//! The cells are in the stator's frame, because the flux of the stator's iron turns in operation and reverses under
//! pulses. They are isotropic, so they are the same in the frame of a rotor at rest. A turning rotor drags the stator's
//! memory along, which gives a torque. Rotor iron is assumed to have no hysteresis, because its flux hardly changes in
//! operation.

/// Cells that a motor may have.
pub const MOST_CELLS: usize = 3;

/// Hysteresis of a stator's iron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hysteresis {
    /// Peak current in A equivalent to a coercive field strength in the iron: Σ κ, the remaining force of the cells
    /// after a large change of the flux.
    pub coercive_current: f64,
    /// Reduction of the inductance for pulses that are too small to move any pinned flux, as a share of the smaller of
    /// L_d and L_q without current; above 0, below 1. It follows from the iron's initial permeability.
    pub depth: f64,
    /// Number of cells, 1 to [`MOST_CELLS`].
    pub cells: u8,
}

/// A cell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cell {
    /// K in 1/H; 0: no cell.
    pub stiffness: f64,
    /// r in Wb.
    pub reach: f64,
}

impl Hysteresis {
    /// Returns the cells; `inductance`: the smaller incremental inductance in H at no current. The cells have equal
    /// stiffness, and the reach of cell k of n is (2 k − 1)/n of the mean. By the midpoint rule they approximate
    /// Rayleigh's law, whose loss is in proportion to the cube of a small amplitude.
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
