//! Terminals with a capacitance that devices connect to the rails at an instant, and the link's capacitor, which charges
//! them.

/// Terminals and link just before devices connect the terminals to the rails.
#[derive(Clone, Copy, Debug)]
pub struct Joined {
    /// Potentials in V of the terminals.
    pub potential: [f64; 3],
    /// Voltage in V of the link.
    pub link: f64,
    /// Capacitance of one terminal divided by that of the link's capacitor; zero if the link is stiff.
    pub share: f64,
}

/// Terminals and link after devices have charged the terminals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Potentials in V of the terminals.
    pub potential: [f64; 3],
    /// Voltage in V of the link.
    pub link: f64,
    /// True for each leg that was charged from the upper rail.
    pub upper: [bool; 3],
}

/// Largest number of iterations that find the legs connected to the upper rail. Two suffice if a terminal's capacitance is a small
/// part of the link's.
const PASSES: usize = 8;

impl Joined {
    /// Returns terminals and link after devices have charged the terminals at one instant. `held(leg, link)` returns the potential in V
    /// at which the leg's device holds its terminal at the link's voltage `link` in V, and whether this device is at the upper
    /// rail. If none of the leg's devices conducts, it returns the terminal's own potential.
    ///
    /// The link's capacitor loses the charge that the terminals at the upper rail take up, so these potentials fall with the
    /// link's voltage: `C_l (U − U′) = C_t Σ (u′ − u)` over the legs whose devices are at the upper rail, where each u′ depends on U′.
    pub fn settle(&self, held: impl Fn(usize, f64) -> (f64, bool)) -> Settled {
        let at = |link: f64| -> [(f64, bool); 3] { std::array::from_fn(|leg| held(leg, link)) };
        let mut link = self.link;
        let mut legs = at(link);
        for _ in 0..PASSES {
            let (mut risen, mut count) = (0.0, 0.0);
            for ((potential, upper), before) in legs.into_iter().zip(self.potential) {
                if upper {
                    risen += potential - before;
                    count += 1.0;
                }
            }
            let missing = (self.link - link) - self.share * risen;
            if missing == 0.0 {
                break;
            }
            link += missing / (1.0 + count * self.share);
            let joined = legs.map(|(_, upper)| upper);
            legs = at(link);
            if legs.map(|(_, upper)| upper) == joined {
                break;
            }
        }
        Settled { potential: legs.map(|leg| leg.0), link, upper: legs.map(|leg| leg.1) }
    }
}

#[cfg(test)]
mod tests;
