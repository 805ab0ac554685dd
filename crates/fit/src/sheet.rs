//! Writes the data sheet of the motor that was found.

use std::fmt::Write as _;

use standstill_plant::Motor;
use standstill_quantity::unit::Ampere;
use standstill_quantity::{Quantity, Scale, magnitude};

use super::Fit;

/// Writes a value with its unit, in six digits.
fn quantity(value: f64, symbol: &str) -> String {
    let scale = Scale::suiting(symbol, value.abs());
    let number = scale.number(value);
    let digits = usize::try_from(5 - magnitude(number).unwrap_or(0)).unwrap_or(0);
    let text = format!("{number:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    format!("{text} {}", scale.unit).trim_end().to_owned()
}

/// Writes a share in per cent.
fn percent(share: f64) -> String {
    // Adding zero turns −0 into 0.
    format!("{} %", (share * 1e4).round() / 100.0 + 0.0)
}

/// Function that writes a value with its unit for a data sheet.
type Written = fn(f64, &str) -> String;

impl Fit {
    /// Returns the estimate of a parameter as a data sheet's entry; none if it is not identified.
    fn measured(&self, name: &str, symbol: &str, write: Written) -> Option<String> {
        let estimate = self.identified(name)?;
        let [low, high] = estimate.interval?;
        Some(format!(
            "{{ value = \"{}\", source = \"measured\", reason = \"95 % interval {} to {}\" }}",
            write(estimate.value, symbol),
            write(low, symbol),
            write(high, symbol)
        ))
    }

    /// Writes the motor as a data sheet: the measured values, and the others with their origin. `files` names the files of the
    /// records, `start` is the initial motor of the fit.
    ///
    /// Saturation is left out if the readings do not determine it and the initial motor has none: then the pole is unknown.
    pub fn sheet(&self, files: &str, start: Option<&Motor>) -> String {
        let clean = |text: &str| text.replace(['"', '\\', '\n', '\r'], " ");
        let mut text = format!(
            "title = \"A motor fitted to {}\"\nnotes = \"\"\"\n\
             Measured by channels whose common gain counts as 1: resistance and inductances are in proportion to its inverse. The\n\
             magnet's flux, pole pairs and friction do not show in currents at standstill.\"\"\"\n\n[nameplate]\n",
            clean(files)
        );
        if !self.describes() || !self.converged {
            let why = "WARNING: the simulation does not describe these currents, or the search did not end at the most likely\n\
                       parameters. What is called measured here is not to be relied on.\n\"\"\"\n\n[nameplate]";
            text = text.replacen("\"\"\"\n\n[nameplate]", &format!("\n{why}"), 1);
        }
        // A count stands as it is, a quantity with its unit is a text.
        let assumed = |value: String, reason: &str| {
            format!("{{ value = {value}, source = \"assumed\", reason = \"{}\" }}", clean(reason))
        };
        let quoted = |text: String| format!("\"{text}\"");
        let name = start.map(|motor| motor.name.clone());
        let of_start = name.map(|name| format!("as of {name}, which the fit began with"));
        let or = |guess: &str| of_start.clone().unwrap_or_else(|| guess.to_owned());
        let pole_pairs = start.map_or(4, |motor| motor.pole_pairs);
        let mut line = |key: &str, value: String| {
            let _ = writeln!(text, "{key} = {value}");
        };
        line(
            "pole_pairs",
            assumed(pole_pairs.to_string(), &or("a guess; only matters where the rotor can move")),
        );
        for (key, symbol, value) in [
            ("resistance", "Ω", self.plant.resistance),
            ("L_d", "H", self.plant.inductance[0]),
            ("L_q", "H", self.plant.inductance[1]),
        ] {
            let fixed =
                || assumed(quoted(quantity(value, symbol)), &or("a guess: these pulses do not tell it"));
            line(key, self.measured(key, symbol, quantity).unwrap_or_else(fixed));
        }
        let guess = "a guess, three times what the largest current makes: no current at standstill tells it";
        line("magnet_flux", assumed(quoted(quantity(self.magnet_flux, "Wb")), &or(guess)));
        line(
            "rated_current",
            assumed(quoted(quantity(self.current, "A")), &or("the largest current of the pulses")),
        );
        let link = quantity((self.link * 100.0).round() / 100.0, "V");
        line(
            "dc_link",
            format!(
                "{{ value = \"{link}\", source = \"measured\", reason = \"mean while the pulses drove\" }}"
            ),
        );
        if let Some(falls) = self.falls {
            text += "\n[nameplate.saturation]\n";
            let keys = [("d", "saturation.d"), ("minus_d", "saturation.minus_d"), ("q", "saturation.q")];
            for ((key, name), fall) in keys.into_iter().zip(falls) {
                let share = |value: f64, _: &str| percent(value);
                // What noise makes negative is none.
                let fall = if key == "q" { fall.max(0.0) } else { fall };
                let reached = self.identified(name).and_then(|estimate| estimate.at);
                let beyond = reached.filter(|at| *at < self.current).map(|at| {
                    let reason = format!(
                        "extrapolated: the pulses reached {} along this axis",
                        Quantity::<Ampere>::si((at * 10.0).round() / 10.0)
                    );
                    assumed(quoted(percent(fall)), &reason)
                });
                let measured = || self.measured(name, "", share).filter(|_| key != "q" || fall > 0.0);
                let kept = beyond.or_else(measured);
                let fixed = || of_start.as_ref().map(|reason| assumed(quoted(percent(fall)), reason));
                // Without a start, what is left out follows from d.
                if let Some(value) = kept.or_else(fixed) {
                    let _ = writeln!(text, "{key} = {value}");
                }
            }
        }
        text += &self.eddy_table();
        if let Some(motor) = start {
            let reason = or("");
            let rotor = &motor.rotor;
            text += "\n[rotor]\n";
            for (key, value, unit) in [
                ("inertia", rotor.inertia, "kg m²"),
                ("stiction", rotor.friction.stiction, "N m"),
                ("coulomb", rotor.friction.coulomb, "N m"),
                ("viscous", rotor.friction.viscous, "N m s"),
            ] {
                let _ = writeln!(text, "{key} = {}", assumed(format!("\"{value} {unit}\""), &reason));
            }
        }
        text
    }

    /// Writes the eddy currents; nothing where the readings show none.
    fn eddy_table(&self) -> String {
        let Some(time) = self.measured("eddy.time_constant", "s", quantity) else { return String::new() };
        let mut text = format!("\n[eddy]\ntime_constant = {time}\n");
        // Plain numbers, which stand without quotes.
        let share = |value: f64, _: &str| format!("{value:.4}");
        let depths = [("d_depth", self.plant.eddy.d_depth), ("q_depth", self.plant.eddy.q_depth)];
        for (key, depth) in depths {
            let guess = "source = \"assumed\", reason = \"a guess: these pulses do not tell it\"";
            let measured = self.measured(&format!("eddy.{key}"), "", share);
            let value = measured.unwrap_or_else(|| format!("{{ value = \"{depth:.4}\", {guess} }}"));
            let _ = writeln!(text, "{key} = {}", value.replacen('"', "", 2));
        }
        text
    }
}
