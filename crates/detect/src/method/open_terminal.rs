//! Axis and pole from the voltage of the floating terminal; no current is read.
//!
//! ```text
//!   all high ─► off ─► AB+ ─► AB− ─► BC+ ─► BC− ─► CA+ ─► CA−      each pulse: on, then all gates off
//! ```
//! While a pulse is applied to a line, the third leg is off, and its terminal divides the line's voltage in the ratio
//! of the inductances of the two phases. With the voltage u across the line less the resistive drop, the deviation dev
//! of the third terminal from the mean of the other two, k = L_B/L_A and the line's direction φ:
//! ```text
//!   r = dev/u = −(√3/2) k sin 2(θ − φ) / (1 + k cos 2(θ − φ))
//!   r + c (r cos 2φ − (√3/2) sin 2φ) + s (r sin 2φ + (√3/2) cos 2φ) = 0,   c = k cos 2θ,  s = k sin 2θ
//! ```
//! Three lines give two unknowns by least squares, exactly on a linear core. Half the difference of both signs is free
//! of offsets, and to first order of saturation. The difference between the signs reveals the pole. The third phase
//! carries no current, so the current lies along the line: `i_d = I cos x` with x = φ − θ. With 1/L_d = (1 + β
//! i_d)/L_d0, L = (L_d + L_q)/2 and `I = u t / (√3 L (1 + k cos 2x))`, to first order
//! ```text
//!   r⁺ − r⁻ = −β (u t/L) (1 − k²) sin x (cos² x + ρκ (ρ sin² x − 2 cos² x)) / (1 + k cos 2x)³,   ρ = L_q/L_d
//! ```
//! where the current along d raises 1/L_q by κ times as much as 1/L_d, and, by reciprocity, ψ_q raises the coupling
//! 1/L_dq at the same rate. β is positive if north draws more current. The template changes its sign with the pole, and
//! only its sign and shape are used, so nothing about the saturation need be known except which pole draws more
//! current. Gains of the dividers that differ by half a per cent would have the same effect, so the dividers are
//! compared on an all-high vector first.
//!
//! A magnet of flux ψ that turns at ω induces the voltage `e = ωψ` along the q-axis, which appears at the third
//! terminal and in the line that drives the current. In the difference of both signs, the part of saturation is odd in
//! x, and that of the induced voltage is even:
//! ```text
//!   r⁺ − r⁻ = −(3 ωψ/U) (1 + k) cos x / (1 + k cos 2x)
//! ```

mod samples;
mod settings;
#[cfg(test)]
mod tests;
mod turning;

use standstill_interface::{
    Abc, AlphaBeta, Angle, Command, Fault, Findings, Leg, Nanos, Phase, Reading, Real, Sampling, Sensed,
    Stage, Step,
};

use crate::method::Sequence;
use crate::parts::complex::{Complex, Turning as _};
use crate::parts::lines::line_angles;
use crate::parts::margin::Margin;
use crate::parts::polarity::{Pointer, Pole};
use crate::parts::settle::{is_reading, link};
use crate::parts::train::Slot;
use crate::parts::{instant, significance};
use crate::settings::SettingsError;

pub use settings::OpenTerminalSettings;
use turning::Pulses;

/// Least voltage across a line or of an all-high vector, as a share of the link's.
const LEAST_VOLTAGE: f64 = 0.5;

/// Largest difference of the terminals at rest, as a share of the link's voltage: while a diode conducts they differ by all
/// of it.
const MOST_AT_REST: f64 = 0.25;

/// Number of passes that compute the solution and, from it, the resistive drop of each line.
const PASSES: usize = 6;

/// Sums in V over the samples and rounds of the pulses of one line in one direction: the voltage across the line, and
/// the deviation of the third terminal from the mean of the other two.
#[derive(Clone, Copy, Debug)]
struct Sums<T> {
    across: T,
    apart: T,
}

/// Solution of the three lines' equations.
#[derive(Clone, Copy, Debug)]
struct Solution<T> {
    /// c = k cos 2θ and s = k sin 2θ.
    c: T,
    s: T,
    /// Derivatives of c and s with respect to r of each line.
    slopes: [[T; 2]; 3],
    /// Difference of r between the pulses forward and back, by line.
    differences: [T; 3],
}

/// The command being carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Under {
    Nothing,
    Comparison,
    Pulse(Slot),
    Rest,
}

/// The detector by the open terminal's voltage.
#[derive(Clone, Debug)]
pub struct OpenTerminal<T> {
    settings: OpenTerminalSettings<T>,
    under: Under,
    given: u16,
    waits: u16,
    /// Gains of the dividers relative to their mean.
    gain: [T; 3],
    /// Sums for each line, backward and forward.
    sums: [[Sums<T>; 2]; 3],
    /// Sum of the squared second differences of successive samples in V²; the next field is their number.
    squares: T,
    differences: T,
    /// Number of rounds to give: that of the settings, or two.
    rounds: u8,
    /// End of the last command given; the field after it is the sum in ns, by line, of the instants at which the pulses began.
    clock: Nanos,
    begins: [u64; 3],
    findings: Findings<T>,
    margin: Margin<T>,
}

impl<T: Real> OpenTerminal<T> {
    /// Makes a detector, ready for its first step.
    ///
    /// # Errors
    /// The method cannot work with one of the settings.
    pub fn new(settings: OpenTerminalSettings<T>) -> Result<Self, SettingsError> {
        settings.check()?;
        let zero = T::zero();
        Ok(Self {
            settings,
            under: Under::Nothing,
            given: 0,
            waits: 0,
            gain: [T::one(); 3],
            sums: [[Sums { across: zero, apart: zero }; 2]; 3],
            squares: zero,
            differences: zero,
            rounds: settings.rounds,
            clock: Nanos::ZERO,
            begins: [0; 3],
            findings: Findings::default(),
            margin: Margin::new(),
        })
    }

    /// Returns the voltage in V of a terminal as its divider shows it. `low`: whether the leg's lower switch is on, so
    /// that the voltage is near zero, below the converter's resolution.
    fn shown(reading: &Reading<T>, phase: Phase, low: bool) -> Result<T, Fault<T>> {
        let value = reading.terminal[phase];
        match reading.terminal_sensed[phase] {
            Sensed::Hidden => Err(Fault::TerminalHidden),
            Sensed::Clipped if !low => Err(Fault::TerminalClipped),
            _ if !is_reading(value) => Err(Fault::NotANumber),
            _ => Ok(value),
        }
    }

    /// Computes the gain of each divider from the mean of its terminal over the all-high vector.
    fn compare(&mut self, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let s = self.settings;
        if readings.len() != s.samples_in(s.pulse) {
            return Err(Fault::UnexpectedReadings);
        }
        let (from, to) = s.window();
        let mut sums = [T::zero(); 3];
        let mut least = T::zero();
        for reading in &readings[from..to] {
            least = least + link(reading)? * T::of(LEAST_VOLTAGE);
            for phase in Phase::ALL {
                sums[phase as usize] = sums[phase as usize] + Self::shown(reading, phase, false)?;
            }
        }
        for sum in sums {
            self.enough(sum, least)?;
        }
        let mean = (sums[0] + sums[1] + sums[2]) / T::of(3.0);
        self.gain = sums.map(|sum| sum / mean);
        Ok(())
    }

    fn enough(&mut self, voltage: T, least: T) -> Result<(), Fault<T>> {
        self.margin.at_least(voltage, least);
        if voltage >= least { Ok(()) } else { Err(Fault::NoVoltage) }
    }

    fn pulse(&mut self, slot: Slot, readings: &[Reading<T>]) -> Result<(), Fault<T>> {
        let s = self.settings;
        if readings.len() != s.samples() {
            return Err(Fault::UnexpectedReadings);
        }
        let (from, to) = s.window();
        let (high, low) = slot.phases();
        let open = Phase::ALL[3 - high as usize - low as usize];
        let (zero, half) = (T::zero(), T::of(0.5));
        let mut sums = Sums { across: zero, apart: zero };
        let mut least = zero;
        let mut before = [zero; 2];
        for (n, reading) in readings[from..to].iter().enumerate() {
            let of =
                |phase: Phase, is_low| Ok(Self::shown(reading, phase, is_low)? / self.gain[phase as usize]);
            let (top, bottom, third) = (of(high, false)?, of(low, true)?, of(open, false)?);
            least = least + link(reading)? * T::of(LEAST_VOLTAGE);
            let apart = third - (top + bottom) * half;
            sums.across = sums.across + (top - bottom);
            sums.apart = sums.apart + apart;
            if n >= 2 {
                let second = apart - before[1] - (before[1] - before[0]);
                self.squares = self.squares + second * second;
                self.differences = self.differences + T::one();
            }
            before = [before[1], apart];
        }
        self.enough(sums.across, least)?;
        let all = &mut self.sums[slot.line][usize::from(slot.forward)];
        all.across = all.across + sums.across;
        all.apart = all.apart + sums.apart;
        Ok(())
    }

    /// Returns whether the terminals have come to rest at the last reading.
    fn rests(&mut self, readings: &[Reading<T>]) -> Result<bool, Fault<T>> {
        let Some(last) = readings.last() else { return Err(Fault::UnexpectedReadings) };
        let mut shown = [T::zero(); 3];
        for phase in Phase::ALL {
            // While a diode conducts, a terminal may lie beyond its divider's range.
            shown[phase as usize] = Self::shown(last, phase, true)?;
        }
        let [a, b, c] = shown;
        let spread = a.max(b).max(c) - a.min(b).min(c);
        let most = link(last)? * T::of(MOST_AT_REST);
        let (rests, gives_up) = (spread <= most, self.waits >= self.settings.attempts);
        if rests || gives_up {
            self.margin.at_most(spread, most);
            let (waits, attempts) = (self.waits.saturating_add(1), self.settings.attempts.saturating_add(1));
            self.margin.waited(waits, attempts, spread / most);
        }
        if !rests && gives_up { Err(Fault::TerminalsSwing) } else { Ok(rests) }
    }

    /// Returns the next command, and advances the clock by its duration.
    fn next_command(&mut self) -> Option<Command<T>> {
        let command = self.following()?;
        self.clock = self.clock + command.duration();
        Some(command)
    }

    fn following(&mut self) -> Option<Command<T>> {
        let s = self.settings;
        let high = Stage { legs: Abc::new(Leg::High, Leg::High, Leg::High), duration: s.pulse };
        if self.under == Under::Nothing && s.comparison {
            self.under = Under::Comparison;
            return Some(Command::sequence(high, Stage::off(s.rest), s.sampling(s.pulse)));
        }
        if self.given >= u16::from(self.rounds) * 6 {
            return None;
        }
        let slot = Slot::of(self.given);
        self.given += 1;
        self.waits = 0;
        self.begins[slot.line] += self.clock.0;
        self.under = Under::Pulse(slot);
        let (from, to) = slot.phases();
        let sampling = s.sampling(s.pulse + s.rest);
        Some(Command::sequence(Stage::line(from, to, s.pulse), Stage::off(s.rest), sampling))
    }

    /// Solves the three lines' equations.
    fn solve(&self) -> Solution<T> {
        let s = &self.settings;
        let (zero, one, two) = (T::zero(), T::one(), T::of(2.0));
        let root = T::of(3.0).sqrt() / two;
        let turns = line_angles::<T>().map(|angle| (angle * two).sin_cos());
        let mut found = [zero; 2];
        let mut differences = [zero; 3];
        let mut slopes = [[zero; 2]; 3];
        for _ in 0..PASSES {
            let (mut aa, mut ab, mut bb, mut ar, mut br) = (zero, zero, zero, zero, zero);
            let mut rows = [[zero; 3]; 3];
            for (k, (sin, cos)) in turns.into_iter().enumerate() {
                let lines = one + found[0] * cos + found[1] * sin;
                let left = self.left(s.line_inductance * lines);
                let [back, forward] = self.sums[k].map(|sums| sums.apart / (sums.across * left));
                // Backward the line's voltage has the other sign.
                let r = (forward - back) / two;
                differences[k] = forward + back;
                let (a, b) = (r * cos - root * sin, r * sin + root * cos);
                (aa, ab, bb) = (aa + a * a, ab + a * b, bb + b * b);
                (ar, br) = (ar + a * r, br + b * r);
                rows[k] = [a, b, lines];
            }
            let determinant = aa * bb - ab * ab;
            found = [(ab * br - bb * ar) / determinant, (ab * ar - aa * br) / determinant];
            slopes = rows.map(|[a, b, lines]| {
                [(ab * b - bb * a) / determinant * lines, (ab * a - aa * b) / determinant * lines]
            });
        }
        Solution { c: found[0], s: found[1], slopes, differences }
    }

    fn answer(&mut self) -> Result<Pole<T>, Fault<T>> {
        let s = self.settings;
        let solution = self.solve();
        let (one, two) = (T::one(), T::of(2.0));
        let (c, sine) = (solution.c, solution.s);
        let ratio = c.hypot(sine);
        if !ratio.is_finite() {
            return Err(Fault::NotANumber);
        }
        let sign: T = s.saliency.factor();
        let twice = Angle::from_radians(Complex::new(c * sign, sine * sign).argument());
        let axis = Angle::from_radians(twice.radians() / two);

        // Variance of dev by one sample's noise, and of its mean over a line's pulses in one direction, relative to u.
        let noise = self.squares / self.differences.max(one) / T::of(6.0);
        let used = T::of(s.used() as f64);
        let samples = used * T::of(f64::from(self.rounds));
        let across =
            self.sums.iter().flatten().fold(T::zero(), |sum, of| sum + of.across) / samples / T::of(6.0);
        let voltage = across * across;
        let one_way = noise / samples / voltage;
        // Gains of dividers, each relative to the mean: as compared, or as tolerated. dev has noise of 3/2 dividers.
        let gain = if s.comparison {
            noise / T::of(1.5) / used / voltage
        } else {
            s.gain_tolerance * s.gain_tolerance
        };
        let of_axis = one_way / two + gain / T::of(8.0);
        let squares = |towards: [T; 2]| {
            solution.slopes.iter().fold(T::zero(), |sum, slope| {
                let slope = slope[0] * towards[0] + slope[1] * towards[1];
                sum + slope * slope
            })
        };
        let across_axis = squares([-sine / ratio, c / ratio]);
        let along_axis = squares([c / ratio, sine / ratio]);
        let needed = significance::known(of_axis * across_axis.max(along_axis));
        significance::check(&mut self.margin, ratio, needed, s.least_saliency)?;
        if ratio >= one {
            return Err(Fault::NotInductive(Phase::A));
        }
        self.findings.age = Some(instant::age(self.clock, self.instant(axis)));
        // θ turns by half the angle by which c + js does.
        self.findings.angle_deviation = Some((of_axis * across_axis).sqrt() / (two * ratio));

        let k = sign * ratio;
        let (mut product, mut square) = (T::zero(), T::zero());
        for (angle, difference) in line_angles::<T>().into_iter().zip(solution.differences) {
            let [_, template] = self.templates(k, angle - axis.radians());
            product = product + template * difference;
            square = square + template * template;
        }
        let offset = s.offset * s.offset / voltage;
        let offsets = if s.comparison { T::of(1.5) } else { T::of(6.0) };
        let of_line = two * one_way + T::of(1.5) * gain + offsets * offset + s.pole_floor * s.pole_floor;
        let along = product / square;
        let (sin, cos) = axis.radians().sin_cos();
        let direction = AlphaBeta::new(cos * along, sin * along);
        let pointer = Pointer { direction, deviation: (of_line / square).sqrt() };
        self.check_standing(&Pulses { solution: &solution, k, product, square, of_line, across }, axis)?;
        Ok(pointer.read(axis, s.signature, s.pole_error))
    }
}

impl<T: Real> Sequence<T> for OpenTerminal<T> {
    fn next(&mut self, readings: &[Reading<T>]) -> Result<Step<T>, Fault<T>> {
        let s = self.settings;
        match self.under {
            Under::Nothing | Under::Rest => {}
            Under::Comparison => self.compare(readings)?,
            Under::Pulse(slot) => self.pulse(slot, readings)?,
        }
        if matches!(self.under, Under::Pulse(_) | Under::Rest) && !self.rests(readings)? {
            self.under = Under::Rest;
            self.waits += 1;
            self.clock = self.clock + s.rest;
            return Ok(Step::Drive(Command::hold(Stage::off(s.rest), Sampling::once(s.rest))));
        }
        if let Some(command) = self.next_command() {
            return Ok(Step::Drive(command));
        }
        let margin = self.margin;
        match self.answer() {
            // The turn of a light rotor by the pulses themselves cancels in a second round.
            Err(Fault::RotorTurns { .. }) if self.rounds == 1 => {
                (self.rounds, self.margin) = (2, margin);
                self.next_command().map(Step::Drive).ok_or(Fault::UnexpectedReadings)
            }
            answer => Ok(Step::Done(answer?.outcome(self.findings))),
        }
    }

    fn so_far(&self) -> (&Findings<T>, Margin<T>) {
        (&self.findings, self.margin)
    }
}
