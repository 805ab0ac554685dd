//! Plausibility checks of a motor's numbers. They judge the magnet's voltage, the torque, the time constants and the
//! voltages at rated current, and find the slip of a data sheet that explains an implausible value.
//!
//! Implausible numbers differ from those of machines by orders of magnitude, such as by a forgotten prefix or a flux
//! per mechanical radian. The factors √2, √3 and 2 between rms and peak, phase and line, poles and pole pairs are too
//! small for that. They are found only if the sheet has redundant numbers, such as rated torque and speed beside flux,
//! current and DC link.

mod slips;
#[cfg(test)]
mod tests;

use standstill_numeric::{hypot, ln};
use standstill_quantity::{count, listed, short};

use self::slips::Slip;
use crate::{Motor, Ratings};

/// Formats a speed in rpm: whole numbers from 1000 rpm on.
fn rpm(speed: f64) -> String {
    if (1e3..1e15).contains(&speed) {
        format!("{} rpm", count(speed.round()))
    } else {
        format!("{} rpm", short(speed))
    }
}

/// Implausible numbers, and the slips that would explain them.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubtful {
    /// Implausible machine that the numbers describe, in words.
    pub what: String,
    /// The slip that would explain it, by its key, its factor and the number that is then meant; the likelier one first. None: no single
    /// slip explains it.
    pub guesses: Vec<Guess>,
}

/// A slip, and the number that is then meant.
#[derive(Clone, Debug, PartialEq)]
pub struct Guess {
    /// The key of the wrong number.
    pub key: &'static str,
    /// Factor from the number found to the number meant.
    pub factor: f64,
    /// Description in words.
    pub said: String,
    /// Keys of a nameplate with the numbers that are meant, each with its unit.
    pub meant: Vec<(&'static str, String)>,
}

impl Doubtful {
    /// Describes the finding in a line.
    pub fn said(&self) -> String {
        let guesses: Vec<&str> = self.guesses.iter().map(|guess| guess.said.as_str()).collect();
        if guesses.is_empty() {
            return format!("{}; no single slip of a data sheet explains it: look at each number", self.what);
        }
        format!("{}; {}", self.what, guesses.join(", or "))
    }
}

/// The numbers that are checked, in SI.
#[derive(Clone, Copy, Debug)]
struct Numbers {
    pole_pairs: f64,
    resistance: f64,
    /// Inductances along d and q without current.
    inductance: [f64; 2],
    flux: f64,
    current: f64,
    link: Option<f64>,
    ratings: Ratings,
}

/// A quantity that follows from the numbers, and its usual range in machines.
struct Check {
    value: f64,
    /// Plausible range; values beyond it are doubtful.
    range: [f64; 2],
    /// Typical value of machines, and the standard deviation of its logarithm.
    usual: (f64, f64),
    /// Describes an implausible value in words.
    said: fn(&Numbers, f64) -> String,
}

/// Factor from rad/s to revolutions per minute.
const RPM: f64 = 30.0 / std::f64::consts::PI;

impl Motor {
    /// Returns the implausible numbers of the motor; none if all are plausible.
    ///
    /// ```
    /// use standstill_plant::DataSheet;
    ///
    /// let text = DataSheet::built_in_text("light-vehicle").ok_or("not built in")?;
    /// let motor = |text: &str| DataSheet::parse("own", text).and_then(|sheet| sheet.motor());
    /// assert_eq!(motor(text)?.doubtful(), None);
    /// let doubtful = motor(&text.replace("22.5 mWb", "22.5 Wb"))?.doubtful().ok_or("believed")?;
    /// assert!(doubtful.said().contains("did you mean magnet_flux 22.5 mWb?"), "{}", doubtful.said());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn doubtful(&self) -> Option<Doubtful> {
        self.numbers().doubtful().or_else(|| self.doubtful_rotor())
    }

    /// Compares inertia and friction with what rated current can turn: the other numbers are believed. A number that the data sheet does not
    /// give follows from these and is always plausible.
    fn doubtful_rotor(&self) -> Option<Doubtful> {
        let numbers = self.numbers();
        let torque = numbers.torque()[1];
        let friction = self.rotor.friction.stiction.max(self.rotor.friction.coulomb);
        if friction > torque {
            let what = format!(
                "friction is {} the {} that rated current makes: it turns no rotor",
                times(friction / torque),
                listed(&[torque], "N m")
            );
            return Some(Doubtful {
                what,
                guesses: of_unit("rotor.stiction", friction, "N m", &[("mN m", 1e-3)], |f| f < 0.5 * torque),
            });
        }
        let speed =
            numbers.link.filter(|_| numbers.flux > 0.0)? / 3.0_f64.sqrt() / numbers.flux / numbers.pole_pairs;
        let time = |inertia: f64| inertia * speed / torque;
        // From the bare rotor of a servo to a vehicle or a drum behind a gear.
        let range = 2e-4..=120.0;
        let inertia = self.rotor.inertia;
        let units = [("kg cm²", 1e-4), ("g m²", 1e-3), ("g cm²", 1e-7), ("kg mm²", 1e-6)];
        (!range.contains(&time(inertia))).then(|| Doubtful {
            what: format!(
                "rated torque takes {} to bring the inertia to full speed",
                match time(inertia) {
                    time if time > 600.0 => format!("{:.1} h", time / 3600.0),
                    time => listed(&[time], "s"),
                }
            ),
            guesses: of_unit("rotor.inertia", inertia, "kg m²", &units, |inertia| {
                (1e-3..=3.0).contains(&time(inertia))
            }),
        })
    }

    fn numbers(&self) -> Numbers {
        Numbers {
            pole_pairs: f64::from(self.pole_pairs),
            resistance: self.resistance,
            inductance: [self.winding.d_axis_inductance(), self.winding.q_axis_inductance()],
            flux: self.magnet_flux,
            current: self.rated_current,
            link: self.dc_link,
            ratings: self.ratings,
        }
    }
}

impl Numbers {
    /// Returns the geometric mean of the axes' inductances in H.
    fn between(&self) -> f64 {
        (self.inductance[0] * self.inductance[1]).sqrt()
    }

    /// Returns the torques in N m at rated current without saturation: that of the magnet alone, and the largest one
    /// over all angles of the current.
    fn torque(&self) -> [f64; 2] {
        let [l_d, l_q] = self.inductance;
        let of = |share: f64| {
            // |i_d| is this share of the current; its sign is that which helps.
            let i_q = (1.0 - share * share).sqrt() * self.current;
            1.5 * self.pole_pairs * (self.flux + (l_d - l_q).abs() * share * self.current) * i_q
        };
        let most = (0..=50).map(|k| of(f64::from(k) / 50.0)).fold(0.0, f64::max);
        [of(0.0), most]
    }

    /// Returns all checks that the known numbers allow.
    fn checks(&self) -> Vec<Check> {
        let mut checks = vec![];
        let mut check = |value: f64, range: [f64; 2], usual: (f64, f64), said| {
            checks.push(Check { value, range, usual, said });
        };
        let l = self.between();
        let [d, q] = self.inductance;
        check(q / d, [1.0 / 12.0, 12.0], (1.3, 0.7), |_, x| format!("L_q is {} of L_d", times(x)));
        check(l / self.resistance, [1e-5, 0.5], (3e-3, 1.8), |_, x| {
            format!("the winding's time constant L/R is {}", listed(&[x], "s"))
        });
        if self.flux > 0.0 {
            check(l * self.current / self.flux, [0.015, 8.0], (0.25, 0.9), |_, x| {
                format!("rated current makes {} the magnet's flux", times(x))
            });
        }
        if let Some(link) = self.link {
            let phase = link / 3.0_f64.sqrt();
            check(self.resistance * self.current / phase, [3e-4, 1.0], (0.07, 1.2), |_, x| {
                format!(
                    "the resistance takes {:.*} % of the DC link's voltage at rated current",
                    if x < 0.1 { 2 } else { 0 },
                    100.0 * x
                )
            });
            check(1.5 * l * self.current / link, [1e-6, 0.02], (2e-4, 1.6), |_, x| {
                format!("the DC link raises rated current in {}", listed(&[x], "s"))
            });
            if self.flux > 0.0 {
                let speed = phase / self.flux;
                check(speed / std::f64::consts::TAU, [6.0, 6000.0], (250.0, 1.3), |of, x| {
                    let rpm = rpm(60.0 * x / of.pole_pairs);
                    format!("the magnet's voltage fills the DC link at {} ({rpm})", listed(&[x], "Hz"))
                });
                check(speed / self.pole_pairs * RPM, [30.0, 100_000.0], (3000.0, 1.5), |_, x| {
                    format!("the magnet's voltage fills the DC link at {}", rpm(x))
                });
            }
        }
        checks.extend(self.rated_checks());
        checks
    }

    /// Returns the checks that compare with ratings.
    fn rated_checks(&self) -> Vec<Check> {
        let mut checks = vec![];
        let mut check = |value: f64, range: [f64; 2], usual: (f64, f64), said| {
            checks.push(Check { value, range, usual, said });
        };
        let Ratings { power, speed_rpm, torque } = self.ratings;
        let speed = speed_rpm.map(|rpm| rpm / RPM);
        if let Some(torque) = torque {
            let [magnet, most] = self.torque();
            // Saturation takes from the reluctance's part.
            let least = magnet.max(0.4 * most);
            let value = torque / torque.clamp(least, most);
            check(value, [0.78, 1.12], (0.95, 0.07), |of, x| {
                let [magnet, most] = of.torque();
                let makes = if x > 1.0 { most } else { magnet.max(0.4 * most) };
                format!(
                    "rated torque is {} the {} that flux, pole pairs and rated current make",
                    times(x),
                    listed(&[makes], "N m")
                )
            });
        }
        if let (Some(power), Some(speed), Some(torque)) = (power, speed, torque) {
            check(power / (speed * torque), [0.8, 1.25], (1.0, 0.07), |_, x| {
                format!("power is {} what rated torque and speed make", times(x))
            });
        }
        if let (Some(power), Some(link)) = (power, self.link) {
            // One volt-ampere less per watt than 1 is usual; the peak of a motor's current is often that of its rms.
            let most = 3.0_f64.sqrt() / 2.0 * link * self.current;
            check(power / most, [0.05, 1.5], (0.6, 0.5), |_, x| {
                format!("power is {} what rated current takes from the DC link at most", times(x))
            });
        }
        if let (Some(speed), Some(link)) = (speed, self.link) {
            let omega = self.pole_pairs * speed;
            let emf = 3.0_f64.sqrt() * omega * self.flux / link;
            let real = omega * self.flux + self.resistance * self.current;
            // Where a machine's own flux is as large as the magnet's, current along −d takes from it.
            let across = self.between() * self.current;
            let across = if self.flux > 0.0 { across.min(self.flux) } else { across };
            let needed = 3.0_f64.sqrt() * hypot(real, omega * across) / link;
            // Many a motor is rated for a speed well below the one that its link allows.
            check(needed, [0.1, 1.5], (0.7, 0.5), |_, x| {
                format!("rated speed and current take {:.0} % of the DC link's voltage", 100.0 * x)
            });
            if self.flux > 0.0 {
                check(emf, [0.05, 1.3], (0.75, 0.6), |_, x| {
                    format!("at rated speed the magnet's voltage is {:.0} % of the DC link's", 100.0 * x)
                });
            }
        }
        checks
    }

    fn violated(&self) -> Option<Check> {
        // The one that is furthest off says most.
        let off = |check: &Check| {
            let [low, high] = check.range.map(ln);
            (low - ln(check.value)).max(ln(check.value) - high)
        };
        self.checks().into_iter().filter(|check| off(check) > 0.0).max_by(|a, b| off(a).total_cmp(&off(b)))
    }

    /// Returns how unusual the numbers are together: half the sum of the squared deviations of the logarithms.
    fn unusual(&self) -> f64 {
        let checks = self.checks();
        let of = |check: &Check| {
            let (centre, spread) = check.usual;
            let off = (ln(check.value) - ln(centre)) / spread;
            0.5 * off * off
        };
        checks.iter().map(of).sum()
    }

    fn doubtful(&self) -> Option<Doubtful> {
        let violated = self.violated()?;
        let mut explained: Vec<(f64, Slip)> = Slip::all(self)
            .into_iter()
            .map(|slip| (slip.mended(self), slip))
            .filter(|(mended, _)| mended.violated().is_none())
            .map(|(mended, slip)| (mended.unusual() + slip.rare, slip))
            .collect();
        explained.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = explained.first().map_or(f64::INFINITY, |(cost, _)| *cost);
        // Within a factor of e of the likeliest.
        let near = explained.into_iter().take_while(|(cost, _)| *cost < best + 1.0).take(3);
        let guesses = near.map(|(_, slip)| slip.guess(self)).collect();
        Some(Doubtful { what: (violated.said)(self, violated.value), guesses })
    }
}

/// Returns the units, with their factors to that of SI, in which a plain number would be plausible.
fn of_unit(
    key: &'static str,
    value: f64,
    si: &str,
    units: &[(&str, f64)],
    is_plausible: impl Fn(f64) -> bool,
) -> Vec<Guess> {
    let fits = units.iter().filter(|(_, factor)| is_plausible(value * factor));
    let guess = |(unit, factor): &(&str, f64)| Guess {
        key,
        factor: *factor,
        said: format!(
            "{key} {value} {si} looks like a number in {unit}: {:.1e} {si} would fit",
            value * factor
        ),
        meant: vec![(key, format!("{} {si}", short(value * factor)))],
    };
    fits.map(guess).collect()
}

/// Returns a ratio in words.
fn times(x: f64) -> String {
    let digits = if x >= 100.0 { format!("{x:.0}") } else { format!("{x:.2}") };
    let digits = if x < 0.01 { format!("{x:.1e}") } else { digits };
    format!("{digits} times")
}
