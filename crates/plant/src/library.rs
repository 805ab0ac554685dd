//! The built-in motors. Their files in `motors/` are part of the binary.

use crate::{DataSheet, Motor, MotorError};

macro_rules! files {
    ($($name:literal)+) => { &[$(($name, include_str!(concat!("../motors/", $name, ".toml"))),)+] };
}

/// Names and texts. The last four are of drives that read one current, a time or the terminals, with the published sheets that they are
/// from.
const FILES: &[(&str, &str)] = files!(
    "paper-5k5" "gearless-hoist" "pm-reluctance" "surface-magnet" "low-inertia" "cross-saturation" "slot-harmonics"
    "reluctance-6k7" "light-vehicle" "light-vehicle-stiff" "outrunner" "gimbal"
    "fan-ceiling" "pump-submersible" "drone-u8" "hub-hoverboard"
);

/// Returns the names of the built-in motors.
///
/// ```
/// use standstill_plant::{built_in, built_in_names};
///
/// assert!(built_in_names().any(|name| name == "outrunner"));
/// // Every one of them is a motor.
/// assert!(built_in_names().all(|name| built_in(name).is_some()));
/// ```
pub fn built_in_names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// Returns a built-in motor by name; `None` for other names.
///
/// ```
/// use standstill_plant::built_in;
///
/// let motor = built_in("paper-5k5").ok_or("not built in")?;
/// assert_eq!(motor.pole_pairs, 4);
/// assert!(built_in("perpetual").is_none());
/// # Ok::<(), &str>(())
/// ```
pub fn built_in(name: &str) -> Option<Motor> {
    built_in_sheet(name)?.and_then(|sheet| sheet.motor()).ok()
}

fn built_in_sheet(name: &str) -> Option<Result<DataSheet, MotorError>> {
    FILES.iter().find(|(known, _)| *known == name).map(|(file, text)| DataSheet::parse(file, text))
}

impl DataSheet {
    /// Returns the text of a built-in motor's data sheet; `None` for other names.
    pub fn built_in_text(name: &str) -> Option<&'static str> {
        FILES.iter().find(|(known, _)| *known == name).map(|(_, text)| *text)
    }

    /// Makes the data sheet of a built-in motor; `None` for other names.
    pub fn built_in(name: &str) -> Option<Self> {
        built_in_sheet(name)?.ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_every_built_in_is_a_motor_and_says_why() {
        for &(name, text) in FILES {
            let sheet = DataSheet::parse(name, text).unwrap_or_else(|error| panic!("{error}"));
            let motor = sheet.motor().unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(motor.name, name);
            // Sheets that were published print names of their own.
            let published = sheet.notes().contains("Source:");
            for entry in sheet.entries() {
                let least = if published { 0 } else { 10 };
                assert!(entry.reason.len() > least, "{name}: {} has no reason", entry.key);
            }
        }
    }

    #[test]
    fn law_motors_of_simple_drives_name_their_sheet_and_mark_what_it_does_not_print() {
        for name in ["fan-ceiling", "pump-submersible", "drone-u8", "hub-hoverboard"] {
            let sheet = DataSheet::built_in(name).expect("a sheet");
            assert!(sheet.notes().contains("Source:"), "{name}");
            let entries = sheet.entries();
            let of = |source| entries.iter().filter(|entry| entry.source == source).count();
            // Pole pairs and resistance are printed; saliency, current or voltage never all are.
            assert!(of(crate::Source::Given) >= 2 && of(crate::Source::Assumed) >= 2, "{name}: {entries:?}");
        }
    }

    #[test]
    fn analytic_the_poles_of_the_traction_motors_differ_as_their_notes_say() {
        for (name, difference) in [("light-vehicle", 0.145), ("light-vehicle-stiff", 0.049)] {
            let motor = built_in(name).expect("built in");
            let point = crate::PolarityPoint::of(&motor.magnetics, motor.rated_current).expect("convex");
            assert!((point.difference() - difference).abs() < 5e-4, "{name}: {}", point.difference());
        }
    }

    #[test]
    fn regress_a_wrong_number_is_named() {
        let text = FILES[0].1;
        let error = |from: &str, to: &str| {
            assert!(text.contains(from), "{from}");
            let sheet = DataSheet::parse("mine.toml", &text.replacen(from, to, 1));
            sheet.and_then(|sheet| sheet.motor()).expect_err("must be refused").to_string()
        };
        let negative = error("\"1.2 Ω\"", "\"-1.2 Ω\"");
        assert!(negative.starts_with("mine.toml: line "), "{negative}");
        assert!(negative.contains("`winding.resistance` is -1.2 Ω, but must be positive"), "{negative}");
        assert!(error("\"1.2 Ω\"", "\"1.2 mH\"").contains("`1.2 mH` is not a finite number in Ω"));
        assert!(error("\nresistance", "\nresistence").contains("unknown field `resistence`"));
        assert!(error("\"-2.1 mH\"", "\"-21 mH\"").contains("winding.saliency"));
        assert!(error("pole_pairs = { value = 4", "pole_pairs = { value = 0").contains("from 1 to 200"));
        assert!(error("value = 59.0", "value = 0.0").contains("not convex"));
        assert!(
            error("\"9.2 mH\"", "\"10 mH\"").contains("within 2 % of what [saturation] or [map] makes it")
        );
        assert!(error("\"0.45 Wb\"", "\"0.5 Wb\"").contains("winding.magnet_flux"));
        assert!(error("\"550 V\"", "\"0 V\"").contains("rating.dc_link"));
        assert!(error("\"1.2 Ω\"", "\"nan Ω\"").starts_with("mine.toml: line "));
        assert!(error("name = \"paper-5k5\"", "name = \"\"").contains("1 to 60 letters"));
    }
}
