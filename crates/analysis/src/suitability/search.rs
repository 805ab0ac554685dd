//! Searches for settings with which a method meets the demands.
//!
//! The evidence for a pole grows with the square of the current, the precision of the axis with the current itself, and the movement with a
//! higher power. So the search begins at the largest allowed current and goes down in steps of about a fifth. Only if that does not
//! suffice, it changes the number of rounds, in each of which a method repeats its pulses: noise falls with the square root of this number.
//! The current is set by the length of the pulses, or by the threshold of a comparator that ends them.

use standstill_detect::keys::THRESHOLD;
use standstill_detect::{MethodName, Signature};
use standstill_quantity::{magnitude, rounded};
use standstill_scenario::{Rotor, pole_signature};

use super::SuitabilityError;
use super::bench::{Bench, Look, SEARCH, Setting};
use super::margins::Demand;
use super::starts::Starts;

/// Number of simulated motor starts by which settings are judged.
const LOOK: u64 = 64;
/// Number of starts that replaces [`LOOK`] for continuous injection. Such a start takes a hundred times as long.
const SLOW_LOOK: u64 = 12;
/// Number of starts from which the largest current is measured.
const PROBE: u64 = 24;

/// Tried pulse lengths, as shares of the longest allowed one.
const PULSES: [f64; 8] = [1.0, 0.85, 0.72, 0.6, 0.5, 0.36, 0.25, 0.17];
/// Tried numbers of rounds, besides the default.
const ROUNDS: [u8; 4] = [2, 6, 12, 24];
/// Tried currents of the voltage vectors, as shares of the largest allowed current.
const VECTORS: [f64; 6] = [1.0, 0.95, 0.85, 0.7, 0.5, 0.3];
/// Pulse lengths near the best one, as shares of it. They are tried with several numbers of rounds if no other settings suffice.
const NEAR: [f64; 4] = [0.92, 0.96, 1.04, 1.08];
/// Numbers of rounds that are tried with the pulse lengths of [`NEAR`].
const NEAR_ROUNDS: [u8; 5] = [3, 4, 6, 9, 16];
/// Factors by which the voltage of an injection, or the length of the pulses that find the axis, is raised if starts end without an axis.
const LOUDER: [f64; 4] = [1.5, 2.0, 3.0, 4.5];
/// Keys of the detector whose values are searched unless the user sets them. Each of the first three sets the current of a method.
pub(super) const SEARCHED: [&str; 6] =
    ["pulse", "threshold", "vector_current", "rounds", "voltage", "polarity"];
/// Shortest and longest pulse in s that a scenario allows.
const PULSE_RANGE: [f64; 2] = [1e-6, 10e-3];

/// Result of the search for one method's settings.
#[derive(Clone, Debug)]
pub(super) struct Found {
    /// Tried settings, the best first.
    pub looks: Vec<Look>,
    /// The demand that forbids a larger current. None if the DC link cannot drive a larger current, or if the pulse has its largest length.
    pub stop: Option<Demand>,
}

/// Returns true if a method takes a hundred times as long as others.
pub(super) fn is_slow(method: MethodName) -> bool {
    matches!(method, MethodName::HfiRotating | MethodName::HfiPulsating)
}

/// Returns the number of starts from which a method's largest current is measured: [`PROBE`], or a quarter of it for a slow method.
fn probe(method: MethodName) -> u64 {
    if is_slow(method) { PROBE / 4 } else { PROBE }
}

/// Returns true if most of the starts find an axis.
fn has_axis(starts: &Starts) -> bool {
    2 * starts.failed() < starts.summary.trials
}

/// The key that sets the current of a method's pulses, with the values to be tried.
#[derive(Clone, Copy)]
struct Strength {
    key: &'static str,
    /// Value of the key at which approximately the allowed current flows.
    first: f64,
    /// Part of the value that causes no current, such as the dead time in a pulse length.
    dead: f64,
    text: fn(f64) -> String,
    /// Tried values, as shares of the largest value.
    shares: &'static [f64],
}

impl Strength {
    /// Returns the settings with the key set to a share of its largest value. Without a largest value, which is so if the user set the key,
    /// the settings stay as they are.
    fn set(&self, setting: &Setting, largest: Option<f64>, share: f64) -> Setting {
        let text = |largest: f64| (self.text)(self.dead + (largest - self.dead) * share);
        largest.map_or_else(|| setting.clone(), |largest| setting.with(self.key, &text(largest)))
    }
}

impl Bench<'_> {
    /// Searches settings of a method. Nothing is found if the user's settings cannot be set up.
    pub fn search(&self, method: MethodName) -> Result<Found, SuitabilityError> {
        let plain = self.signed(Setting::plain(method))?;
        let mut found = Found { looks: Vec::new(), stop: Some(Demand::Current) };
        match self.strength(&plain)? {
            Some(strength) => self.pulses(&plain, strength, &mut found)?,
            None => self.vectors(&plain, &mut found)?,
        }
        if found.looks.is_empty() {
            found.looks.extend(self.look(plain, LOOK)?);
        }
        // Drop settings that exceed the allowed current, unless there are no others.
        let within = |look: &Look| look.margins.current >= 1.0;
        if found.looks.iter().any(within) {
            found.looks.retain(within);
        }
        found.looks.sort_by(|a, b| b.margins.compare(&a.margins));
        Ok(found)
    }

    /// Returns the settings with the pole signature that is valid at the current of their pulses. The default is the signature of pulses
    /// with half of the rated current. If both poles draw the same current there, the signature near rated current or at the largest
    /// allowed current is set instead, because the pulses will be that strong.
    pub fn signed(&self, setting: Setting) -> Result<Setting, SuitabilityError> {
        let nameplate = self.scenario(&setting, Rotor::Locked)?.nameplate();
        if nameplate.pulse_signature != Signature::None || self.is_set("signature") || is_slow(setting.method)
        {
            return Ok(setting);
        }
        let strongest = pole_signature(self.motor, self.most_current).map(|(signature, _)| signature);
        let of =
            [Some(nameplate.signature), strongest].into_iter().flatten().find(|of| *of != Signature::None);
        Ok(of.map_or(setting.clone(), |of| setting.with("signature", standstill_interface::Choice::name(of))))
    }

    /// Returns settings of a method with the strongest allowed pulses or vectors.
    pub fn strongest(&self, method: MethodName) -> Result<Vec<Setting>, SuitabilityError> {
        let plain = self.signed(Setting::plain(method))?;
        let Some(strength) = self.strength(&plain)? else {
            let plain = self.with_axis(&plain)?;
            let (most, _) = self.grown(&plain, "vector_current", self.most_current, 0.0, &amperes)?;
            let vector = most.map_or(plain.clone(), |most| plain.with("vector_current", &amperes(most)));
            return Ok(vec![vector.clone(), vector.with("polarity", "sequential")]);
        };
        let Strength { key, first, dead, text, shares } = strength;
        let (Some(largest), _) = self.grown(&plain, key, first, dead, &text)? else {
            return Ok(vec![plain]);
        };
        let pulses = shares[..3].iter().map(|share| strength.set(&plain, Some(largest), *share));
        Ok(pulses.flat_map(|setting| [setting.clone(), setting.with("rounds", "12")]).collect())
    }

    /// Returns the key that sets the pulse current, if a method finds axis and pole with the same pulses. None for a method that finds the
    /// pole with separate voltage vectors.
    fn strength(&self, plain: &Setting) -> Result<Option<Strength>, SuitabilityError> {
        let scenario = self.scenario(plain, Rotor::Locked)?;
        let mut detector = scenario.detector;
        if detector.polarity_mut().is_some() {
            return Ok(None);
        }
        let dead = scenario.nameplate().dead_time.seconds();
        Ok(if detector.has_line_pulses() {
            let first = self.first_pulse(plain)?;
            Some(Strength { key: "pulse", first, dead, text: microseconds, shares: &PULSES })
        } else if detector.has(&THRESHOLD) {
            let first = 0.9 * self.most_current;
            Some(Strength { key: "threshold", first, dead: 0.0, text: amperes, shares: &VECTORS })
        } else {
            None
        })
    }

    /// Returns the approximate length, in s, of a pulse at whose end the allowed current flows.
    fn first_pulse(&self, plain: &Setting) -> Result<f64, SuitabilityError> {
        let nameplate = self.scenario(plain, Rotor::Locked)?.nameplate();
        let rated = nameplate.rated_pulse.seconds() * self.most_current / self.motor.rated_current;
        Ok(rated + nameplate.dead_time.seconds())
    }

    /// Tries settings of a method that finds axis and pole with the same pulses. It varies the current first, then the number of rounds.
    fn pulses(&self, plain: &Setting, strength: Strength, found: &mut Found) -> Result<(), SuitabilityError> {
        let detector = self.scenario(plain, Rotor::Locked)?.detector;
        let adaptive = detector.is_adaptive();
        let usual =
            detector.get(&standstill_detect::keys::ROUNDS).map_or(1.0, standstill_detect::Value::number);
        let Strength { key, first, dead, text, shares } = strength;
        let largest = if self.is_set(key) {
            None
        } else {
            let (largest, stop) = self.grown(plain, key, first, dead, &text)?;
            found.stop = stop;
            largest
        };
        let shares = largest.map_or(&[1.0][..], |_| shares);
        let with_share = |share: f64| strength.set(plain, largest, share);
        let mut seen = Vec::new();
        for share in shares {
            let Some(look) = self.look(with_share(*share), LOOK)? else { continue };
            // Shorter pulses give less evidence for the pole: once it is far too small, still shorter ones are not tried.
            let hopeless = look.margins.pole.is_some_and(|pole| pole < 0.15);
            seen.push((*share, look));
            if hopeless {
                break;
            }
        }
        // An adaptive method chooses its number of rounds itself.
        let at_ease = seen.iter().any(|(_, look)| look.margins.is_easy());
        let mut more = Vec::new();
        if !(at_ease || adaptive || self.is_set("rounds")) {
            for (share, look) in &seen {
                for rounds in ROUNDS {
                    let gain = (f64::from(rounds) / usual).sqrt();
                    let margins = look.margins;
                    let weak =
                        margins.pole.is_some_and(|pole| pole * gain < 0.7) || margins.error * gain < 0.7;
                    let restless = margins.movement / gain < 0.4 || margins.time / (gain * gain) < 0.5;
                    if weak || (restless && f64::from(rounds) > usual) {
                        continue;
                    }
                    let setting = with_share(*share).with("rounds", &rounds.to_string());
                    more.extend(self.look(setting, LOOK)?.map(|look| (*share, look)));
                }
            }
        }
        let best = seen.iter().chain(&more).max_by(|a, b| a.1.margins.compare(&b.1.margins));
        let best = best.map(|(share, look)| (*share, look.margins));
        let mut near = Vec::new();
        if let Some((share, margins)) = best
            && !(margins.is_kept() || adaptive || self.is_set("rounds"))
            && margins.worst() > 0.5
        {
            for share in NEAR.iter().map(|factor| factor * share).filter(|share| *share <= 1.0) {
                for rounds in NEAR_ROUNDS {
                    near.extend(self.look(with_share(share).with("rounds", &rounds.to_string()), LOOK)?);
                }
            }
        }
        found.looks.extend(seen.into_iter().chain(more).map(|(_, look)| look).chain(near));
        Ok(())
    }

    /// Tries settings of a method that finds the pole with separate voltage vectors. It varies the current and the decision rule of these
    /// vectors first, then the settings that find the axis.
    fn vectors(&self, plain: &Setting, found: &mut Found) -> Result<(), SuitabilityError> {
        let slow = is_slow(plain.method);
        let trials = if slow { SLOW_LOOK } else { LOOK };
        let mut settings = vec![plain.clone()];
        if self.has_pole && !self.is_set("vector_current") {
            let plain = self.with_axis(plain)?;
            let (most, stop) = self.grown(&plain, "vector_current", self.most_current, 0.0, &amperes)?;
            found.stop = stop;
            if let Some(most) = most {
                settings = VECTORS
                    .iter()
                    .map(|share| plain.with("vector_current", &amperes(most * share)))
                    .collect();
            }
        }
        if self.has_pole && !slow && !self.is_set("polarity") {
            let sequential: Vec<Setting> =
                settings.iter().map(|of| of.with("polarity", "sequential")).collect();
            settings.extend(sequential);
        }
        for setting in settings {
            found.looks.extend(self.look(setting, trials)?);
        }
        // Then vary the settings that find the axis: the length of the pulses, or the voltage.
        let Some(best) = found.looks.iter().max_by(|a, b| a.margins.compare(&b.margins)).cloned() else {
            return Ok(());
        };
        if best.margins.is_easy() {
            return Ok(());
        }
        for setting in self.of_axis(&best.setting, [0.5, 1.5, 2.0, 3.0])? {
            found.looks.extend(self.look(setting, trials)?);
        }
        Ok(())
    }

    /// Returns the settings with which most starts find the axis. They are the given settings, or these with a larger voltage or longer
    /// pulses. This comes before the search of the vectors' current, because a start without an axis ends before its vectors.
    fn with_axis(&self, plain: &Setting) -> Result<Setting, SuitabilityError> {
        let (mut best, mut fewest) = (plain.clone(), u64::MAX);
        for setting in std::iter::once(plain.clone()).chain(self.of_axis(plain, LOUDER)?) {
            let Ok(starts) = self.starts(&setting, Rotor::Locked, SEARCH, probe(plain.method))? else {
                continue;
            };
            if starts.failed() < fewest {
                (best, fewest) = (setting, starts.failed());
            }
            if fewest == 0 {
                break;
            }
        }
        Ok(best)
    }

    /// Returns the settings with one value multiplied by each factor. The value is the voltage of an injection, or else the length of the
    /// pulses that find the axis. The result is empty if the user set this value.
    fn of_axis<const N: usize>(
        &self,
        setting: &Setting,
        factors: [f64; N],
    ) -> Result<Vec<Setting>, SuitabilityError> {
        let slow = is_slow(setting.method);
        let key = if slow { "voltage" } else { "pulse" };
        let scenario = self.scenario(setting, Rotor::Locked)?;
        let of_key = standstill_detect::keys::ALL.into_iter().find(|of| of.name == key);
        let usual = of_key.and_then(|key| scenario.detector.get(key)).filter(|_| !self.is_set(key));
        let text = if slow { volts } else { microseconds };
        let is_allowed = |value: &f64| slow || (PULSE_RANGE[0]..=PULSE_RANGE[1]).contains(value);
        let values = |usual: f64| factors.into_iter().map(move |factor| usual * factor).filter(is_allowed);
        let usual = usual.map(standstill_detect::Value::number);
        Ok(usual.into_iter().flat_map(values).map(|value| setting.with(key, &text(value))).collect())
    }

    /// Finds the value of a key at which the largest current just meets its limit. Returns the value, and the demand that forbids a larger
    /// value. There is no value if none makes a workable setting. The demand is [`Demand::Answers`] if at a larger value most starts
    /// find no axis, and none if the DC link drives no larger current or the pulse has its largest length; otherwise it is the current.
    /// `first` is the first tried value. `dead` is the part of the value that causes no current.
    fn grown(
        &self,
        plain: &Setting,
        key: &'static str,
        first: f64,
        dead: f64,
        text: &dyn Fn(f64) -> String,
    ) -> Result<(Option<f64>, Option<Demand>), SuitabilityError> {
        let trials = probe(plain.method);
        let limits = if key == "pulse" { PULSE_RANGE } else { [f64::MIN_POSITIVE, 1.1 * self.most_current] };
        let (mut value, mut before) = (first.clamp(limits[0], limits[1]), None);
        let wanted = 0.985 * self.most_current;
        let mut best = None;
        for _ in 0..5 {
            let starts =
                self.strained().starts(&plain.with(key, &text(value)), Rotor::Locked, SEARCH, trials)?;
            let Ok(starts) = starts else { return Ok((best, Some(Demand::Current))) };
            if key == "vector_current" && !has_axis(&starts) {
                return Ok((best, Some(Demand::Answers)));
            }
            let peak = starts.summary.peak_current_a;
            if peak <= self.most_current / 1.005 {
                best = Some(best.map_or(value, |best: f64| best.max(value)));
            }
            if (0.975..=0.993).contains(&(peak / self.most_current)) {
                break;
            }
            // The link drives no more current through the resistance, or the pulse has its largest length.
            let saturated =
                before.is_some_and(|(earlier, less): (f64, f64)| value > 1.3 * earlier && peak < 1.1 * less);
            if peak < wanted && (saturated || value >= limits[1]) {
                return Ok((best, None));
            }
            before = Some((value, peak));
            let factor = (wanted / peak.max(1e-9 * wanted)).clamp(0.2, 2.0);
            value = (dead + (value - dead).max(0.1 * value) * factor).clamp(limits[0], limits[1]);
        }
        Ok((best.or(Some(value)), Some(Demand::Current)))
    }
}

/// Formats a time as a scenario file writes it, in microseconds or milliseconds and rounded down to few digits. `seconds` is the time in s.
fn microseconds(seconds: f64) -> String {
    let value = seconds.max(PULSE_RANGE[0]) * 1e6;
    let (step, power) = match value {
        v if v < 20.0 => (1.0, -1),
        v if v < 100.0 => (1.0, 0),
        v if v < 500.0 => (5.0, 0),
        _ => (1.0, 1),
    };
    let value = down(value / step, power) * step;
    if value < 1000.0 { format!("{value} us") } else { format!("{} ms", rounded(value, -3)) }
}

/// Formats a current in A as a scenario file writes it, rounded down to three digits.
fn amperes(value: f64) -> String {
    format!("{} A", down(value, magnitude(value).unwrap_or(0) - 2))
}

/// Formats a voltage in V as a scenario file writes it, rounded down to three digits.
fn volts(value: f64) -> String {
    format!("{} V", down(value, magnitude(value).unwrap_or(0) - 2))
}

/// Rounds down to a multiple of ten to the power `power`.
fn down(value: f64, power: i32) -> f64 {
    rounded((rounded(value, -power) + 1e-9).floor(), power)
}
