//! Terminals that devices join to the rails at an instant, and the capacitor of the link that charges them.

/// Where devices hold the terminals of three legs, and what they hold there.
#[derive(Clone, Copy, Debug)]
pub struct Joined {
    /// Potentials in V of the terminals before.
    pub potential: [f64; 3],
    /// Voltage in V of the link before.
    pub link: f64,
    /// Capacitance of a terminal over that of the link's capacitor; zero if the link is stiff.
    pub share: f64,
}

/// Terminals after their devices have charged them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settled {
    /// Potentials in V of the terminals.
    pub potential: [f64; 3],
    /// Voltage in V of the link.
    pub link: f64,
    /// Whether each leg's charge came from the upper rail.
    pub upper: [bool; 3],
}

/// Passes after which the legs that are joined to the upper rail are found. Two suffice where a terminal's capacitance is a small
/// part of the link's.
const PASSES: usize = 8;

impl Joined {
    /// Returns the terminals after their devices have charged them at once. `held`: the potential in V at which a leg's devices hold a
    /// terminal while the link has a voltage in V, and whether this device is at the upper rail; it is the terminal's own potential where none conducts.
    ///
    /// The capacitor of the link loses the charge that terminals at the upper rail take up, so these fall with it:
    /// `C_l (U − U′) = C_t Σ (u′ − u)` over the legs whose devices are at the upper rail, where each u′ follows U′.
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
