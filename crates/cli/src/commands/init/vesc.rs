//! A data sheet from a motor configuration that VESC Tool saved as XML.
//!
//! The configuration is a table of texts. The relevant keys, as the firmware uses them (`datatypes.h`, `mcpwm_foc.c`),
//! are: `foc_motor_r` in Ω and `foc_motor_l` = (L_d + L_q)/2 in H of a phase, `foc_motor_ld_lq_diff` = L_q − L_d in H,
//! `foc_motor_flux_linkage` in Wb, `si_motor_poles`, and `l_current_max` in A, the peak of a phase.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use standstill_files::read_at_most;
use standstill_quantity::rounded;

use crate::error::Error;

/// Nominal voltage in V and name of each type of battery cell. The index is the value of `si_battery_type`.
const CELLS: [(f64, &str); 3] = [(3.6, "lithium-ion"), (3.2, "lithium iron phosphate"), (2.0, "lead-acid")];

/// Keys of the signal injection in the firmware. A data sheet cannot contain them, so the remarks list them as ignored.
const INJECTION: [&str; 8] = [
    "foc_sensor_mode",
    "foc_hfi_voltage_start",
    "foc_hfi_voltage_run",
    "foc_hfi_voltage_max",
    "foc_hfi_start_samples",
    "foc_hfi_samples",
    "foc_sl_erpm_hfi",
    "foc_hfi_amb_current",
];

/// Largest size of a configuration in bytes. Usual configurations have some ten thousand bytes. The limit bounds the parsing time, which
/// grows with the square of the number of attributes.
const MOST_BYTES: u64 = 1 << 18;

/// Largest number of elements, attributes and texts. Usual configurations have some thousand. The limit bounds the memory of the parser,
/// which is twenty times the size of an element's text.
const MOST_NODES: u32 = 20_000;

/// The settings read from the file.
struct Settings<'a> {
    path: &'a Path,
    texts: BTreeMap<String, String>,
}

impl Settings<'_> {
    fn wrong(&self, found: String, needed: &str) -> Error {
        Error::results(self.path, found, needed)
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Error> {
        let Some(text) = self.texts.get(key) else { return Ok(None) };
        match text.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(Some(number)),
            _ => Err(self.wrong(format!("`{text}` as {key}"), "a finite number")),
        }
    }

    /// Returns the positive number of this key. Fails if the number is missing or not positive.
    fn needed(&self, key: &str) -> Result<f64, Error> {
        match self.number(key)? {
            Some(number) if number > 0.0 => Ok(number),
            Some(number) => Err(self
                .wrong(format!("{key} = {number}"), "a number above zero, as a motor detection leaves it")),
            None => Err(self.wrong(
                format!("no {key}"),
                "all of foc_motor_r, foc_motor_l, foc_motor_flux_linkage, l_current_max, si_motor_poles",
            )),
        }
    }
}

fn read(path: &Path) -> Result<Settings<'_>, Error> {
    let bytes = read_at_most(path, MOST_BYTES).map_err(|error| Error::Read(path.to_owned(), error))?;
    let text = String::from_utf8_lossy(&bytes);
    let mut settings = Settings { path, texts: BTreeMap::new() };
    let needed = "the XML of a motor configuration, as VESC Tool saves it";
    let options = roxmltree::ParsingOptions { nodes_limit: MOST_NODES, ..Default::default() };
    let document = roxmltree::Document::parse_with_options(&text, options)
        .map_err(|error| settings.wrong(error.to_string(), needed))?;
    // The name of the root element has changed between versions; the names of the other elements have not.
    let elements = document.root_element().descendants().filter(roxmltree::Node::is_element);
    for element in elements {
        if let Some(text) = element.text() {
            settings.texts.insert(element.tag_name().name().to_owned(), text.trim().to_owned());
        }
    }
    if !settings.texts.keys().any(|key| key.starts_with("foc_motor")) {
        let root = document.root_element().tag_name().name();
        return Err(settings.wrong(format!("<{root}> without any foc_motor_…"), needed));
    }
    Ok(settings)
}

/// Returns two texts: the data sheet, and the remarks for the terminal on assumed values.
pub fn sheet(path: &Path) -> Result<(String, String), Error> {
    let settings = read(path)?;
    let [r, l, flux] =
        ["foc_motor_r", "foc_motor_l", "foc_motor_flux_linkage"].map(|key| settings.needed(key));
    let (r, l, flux) = (r?, l?, flux?);
    let poles = settings.needed("si_motor_poles")?;
    if poles % 2.0 != 0.0 {
        return Err(settings.wrong(format!("si_motor_poles = {poles}"), "an even number"));
    }
    let current = settings.needed("l_current_max")?;
    let difference = settings.number("foc_motor_ld_lq_diff")?;
    let half = difference.unwrap_or(0.0) / 2.0;
    if half.abs() >= l {
        return Err(settings.wrong(
            format!("foc_motor_ld_lq_diff = {}", 2.0 * half),
            "less than twice foc_motor_l either way",
        ));
    }
    let inductances = match difference {
        Some(_) => ("measured", "foc_motor_l ∓ foc_motor_ld_lq_diff / 2"),
        None => {
            ("assumed", "foc_motor_l; the file has no foc_motor_ld_lq_diff, as of a motor without saliency")
        }
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    // A motor's name may have these characters only.
    let name: String =
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).take(60).collect();
    let mut text = format!(
        "# From {}, a motor configuration of VESC Tool. What it does not say is assumed: `standstill motors FILE` lists it.\n",
        path.file_name().unwrap_or_default().to_string_lossy()
    );
    let _ = writeln!(text, "name = {}\ntitle = \"From a motor configuration of VESC Tool\"", quoted(&name));
    let given: Vec<String> =
        INJECTION.iter().filter_map(|key| Some(format!("{key} {}", settings.texts.get(*key)?))).collect();
    if !given.is_empty() {
        let _ = writeln!(
            text,
            "notes = {}",
            quoted(&format!("Injection of its controller: {}.", given.join(", ")))
        );
    }
    text += "\n[nameplate]\n";
    let mut line = |key: &str, value: String, source: &str, reason: &str| {
        let _ = writeln!(
            text,
            "{key} = {{ value = {value}, source = \"{source}\", reason = {} }}",
            quoted(reason)
        );
    };
    line(
        "pole_pairs",
        format!("{}", poles / 2.0),
        "given",
        "si_motor_poles / 2; 14 poles are what VESC Tool begins with",
    );
    line("resistance", quoted(&format!("{r} Ω")), "measured", "foc_motor_r");
    line("L_d", quoted(&format!("{} H", rounded(l - half, 0))), inductances.0, inductances.1);
    line("L_q", quoted(&format!("{} H", rounded(l + half, 0))), inductances.0, inductances.1);
    line("magnet_flux", quoted(&format!("{flux} Wb")), "measured", "foc_motor_flux_linkage");
    line("rated_current", quoted(&format!("{current} A")), "given", "l_current_max, the peak of a phase");
    let (link, reason) = link(&settings)?;
    line("dc_link", quoted(&format!("{} V", rounded(link, 0))), "assumed", &reason);
    text += "\n# By how much the inductances fall at rated current. The file does not say: without it the pole cannot be judged.\n\
             # saturation = { d = \"6 %\", minus_d = \"-3 %\", q = \"10 %\" }\n";

    let mut said = "Not in the file, and assumed: saturation (the pole cannot be judged without), the DC link, leakage, the rotor.\n".to_owned();
    if difference.is_none() {
        said += "It has no foc_motor_ld_lq_diff: L_q = L_d is assumed, and a motor without saliency has no axis to find.\n";
    }
    let mut keys = Vec::new();
    if let Some(frequency) =
        settings.number("foc_f_zv")?.or(settings.number("foc_f_sw")?).filter(|f| *f > 0.0)
    {
        // `foc_f_zv` is the frequency of the zero vectors, of which there are two in a period of the carrier.
        let carrier = if settings.texts.contains_key("foc_f_zv") { frequency / 2.0 } else { frequency };
        keys.push(format!("-s inverter.carrier=\"{} Hz\"", rounded(carrier, 0)));
    }
    if let Some(dead) = settings.number("foc_dt_us")?.filter(|dead| *dead > 0.0) {
        keys.push(format!("-s inverter.dead_time=\"{dead} us\""));
    }
    if !keys.is_empty() {
        let _ = writeln!(said, "Of its controller, for scenarios: {}", keys.join(" "));
    }
    Ok((text, said))
}

/// Formats a text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::from(text).to_string()
}

/// Returns the DC-link voltage in V and a text that states its source.
fn link(settings: &Settings<'_>) -> Result<(f64, String), Error> {
    let kind = settings.number("si_battery_type")?.unwrap_or(0.0);
    let (volts, name) =
        CELLS.into_iter().zip(0..).find(|(_, k)| f64::from(*k) == kind).map_or(CELLS[0], |(cell, _)| cell);
    Ok(match settings.number("si_battery_cells")?.filter(|cells| *cells > 0.0) {
        Some(cells) => (cells * volts, format!("si_battery_cells = {cells} {name} cells of {volts} V")),
        None => (12.0 * volts, format!("the file does not say; twelve {name} cells of {volts} V")),
    })
}

#[cfg(test)]
mod tests {
    use standstill_plant::DataSheet;

    use super::*;

    /// A motor configuration as VESC Tool saves it. Most of its two hundred settings are omitted.
    const XML: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<MCConfiguration>
    <ConfigVersion>3</ConfigVersion>
    <l_current_max>60</l_current_max>
    <foc_f_zv>30000</foc_f_zv>
    <foc_dt_us>0.12</foc_dt_us>
    <foc_sensor_mode>3</foc_sensor_mode>
    <foc_motor_l>1.4e-05</foc_motor_l>
    <foc_motor_ld_lq_diff>4e-06</foc_motor_ld_lq_diff>
    <foc_motor_r>0.018</foc_motor_r>
    <foc_motor_flux_linkage>0.0034</foc_motor_flux_linkage>
    <foc_hfi_voltage_start>12</foc_hfi_voltage_start>
    <si_motor_poles>14</si_motor_poles>
    <si_battery_type>0</si_battery_type>
    <si_battery_cells>12</si_battery_cells>
</MCConfiguration>
"#;

    fn of(xml: &str) -> Result<(String, String), String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("scooter \"x\".xml");
        std::fs::write(&path, xml).expect("written");
        sheet(&path).map_err(|error| error.to_string())
    }

    #[test]
    fn analytic_the_sheet_is_the_motor_of_the_file() {
        let (text, said) = of(XML).expect("a configuration");
        let sheet = DataSheet::parse("scooter.toml", &text).expect("a data sheet");
        let motor = sheet.motor().expect("a motor");
        assert_eq!((motor.pole_pairs, motor.resistance), (7, 0.018));
        // (L_d + L_q)/2 = 14 µH, L_q − L_d = 4 µH.
        for part in [
            "\"0.000012 H\"",
            "\"0.000016 H\"",
            "\"0.0034 Wb\"",
            "\"60 A\"",
            "\"43.2 V\"",
            "foc_hfi_voltage_start 12",
        ] {
            assert!(text.contains(part), "{part}\n{text}");
        }
        assert!(text.contains("dc_link = { value = \"43.2 V\", source = \"assumed\""), "{text}");
        assert!(
            said.contains("saturation")
                && said.contains("-s inverter.carrier=\"15000 Hz\" -s inverter.dead_time=\"0.12 us\"")
        );
        // Without foc_motor_ld_lq_diff the sheet marks L_d and L_q as assumed.
        let (text, said) = of(&XML.replace("foc_motor_ld_lq_diff", "something")).expect("a configuration");
        assert!(said.contains("no foc_motor_ld_lq_diff"));
        assert!(text.contains("L_q = { value = \"0.000014 H\", source = \"assumed\""), "{text}");
    }

    #[test]
    fn regress_what_would_grow_without_end_is_refused() {
        let begin = std::time::Instant::now();
        let texts = |count: u32, of: &dyn Fn(u32) -> String| (0..count).map(of).collect::<String>();
        let entities = texts(11, &|k| format!("<!ENTITY a{} \"{}\">", k + 1, format!("&a{k};").repeat(10)));
        let laughs =
            format!("<!DOCTYPE x [<!ENTITY a0 \"lol\">{entities}]><x><foc_motor_r>&a11;</foc_motor_r></x>");
        let nested = format!("{}{}", "<a>".repeat(15_000), "</a>".repeat(15_000));
        let deep = nested.replace("<a>", "<a><b/>");
        let attributes = texts(25_000, &|k| format!(" a{k}=\"\""));
        for (xml, message) in [
            (&laughs, "DTD"),
            (&deep, "nodes limit reached"),
            (&format!("<x{attributes}/>"), "<x> without any foc_motor_…"),
            (&"<a/>".repeat(1 << 17), "512.0 KiB; needed: at most 256 KiB"),
            (&"<foc_motor_r>".repeat(1000), "needed the XML of a motor configuration"),
            (&XML[..600].to_owned(), "needed the XML of a motor configuration"),
        ] {
            let error = of(xml).expect_err("refused");
            assert!(error.contains(message), "{message}: {error}");
        }
        assert!(begin.elapsed().as_secs() < 60, "{:?}", begin.elapsed());
        #[cfg(unix)]
        {
            let error = sheet(Path::new("/dev/zero")).expect_err("refused").to_string();
            assert!(error.contains("a pipe or a device"), "{error}");
        }
    }

    #[test]
    fn law_what_is_no_such_file_is_refused_by_name() {
        for (xml, message) in [
            ("", "needed the XML of a motor configuration"),
            ("trials = 10", "needed the XML"),
            ("<svg><path>3</path></svg>", "<svg> without any foc_motor_…"),
            (&XML.replace("0.018", "0"), "foc_motor_r = 0, needed a number above zero"),
            (&XML.replace("0.018", "ten"), "`ten` as foc_motor_r"),
            (&XML.replace("4e-06", "4e-05"), "foc_motor_ld_lq_diff = 0.00004"),
            (&XML.replace(">14<", ">13<"), "si_motor_poles = 13"),
            (&XML.replace("l_current_max", "x"), "no l_current_max"),
        ] {
            let error = of(xml).expect_err("refused");
            assert!(error.contains(message), "{message}: {error}");
        }
    }
}
