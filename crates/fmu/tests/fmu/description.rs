//! Descriptions for importers: variables, units, limits, structure.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use roxmltree::Document as Xml;
use standstill_fmu::{Kind, Part, Version};
use standstill_scenario::Document;

use super::FIELD;
use super::importer::unpacked;

fn number(node: roxmltree::Node, name: &str) -> Option<f64> {
    node.attribute(name).map(|text| text.parse().expect("a number"))
}

fn whole(node: roxmltree::Node, name: &str) -> usize {
    node.attribute(name).and_then(|text| text.parse().ok()).expect("a whole number")
}

#[test]
fn law_the_description_has_all_variables_with_units_limits_and_starts() {
    for (part, version) in [
        (Part::Drive, Version::Two),
        (Part::Motor, Version::Two),
        (Part::Drive, Version::Three),
        (Part::Motor, Version::Three),
    ] {
        let model = unpacked(FIELD, part).model;
        let text = model.description(version);
        let xml = Xml::parse(&text).expect("XML");
        let find = |name: &str| xml.descendants().filter(|node| node.has_tag_name(name)).collect::<Vec<_>>();
        let units: BTreeSet<_> =
            find("Unit").iter().map(|unit| unit.attribute("name").expect("a name")).collect();
        let listed: Vec<_> =
            find("ModelVariables")[0].children().filter(roxmltree::Node::is_element).collect();
        let expected = model.variables.len()
            - if version == Version::Three {
                0
            } else if part == Part::Drive {
                2
            } else {
                1
            };
        assert_eq!(listed.len(), expected);
        let mut references = BTreeSet::new();
        let (mut outputs, mut clocked) = (BTreeSet::new(), 0);
        for (place, node) in listed.iter().enumerate() {
            let reference: usize = whole(*node, "valueReference");
            assert!(references.insert(reference));
            let variable = &model.variables[reference];
            assert_eq!(node.attribute("name"), Some(variable.name.as_str()));
            let values =
                if version == Version::Two { node.first_element_child().expect("values") } else { *node };
            if let Some(unit) = values.attribute("unit") {
                assert!(units.contains(unit), "{unit}");
            }
            assert_eq!(
                values.has_attribute("unit"),
                variable.kind == Kind::Real && !variable.unit.is_empty()
            );
            assert!(!node.attribute("description").expect("one").is_empty());
            let fixed = variable.is_parameter() || (variable.is_input() && variable.kind != Kind::Clock);
            assert_eq!(values.has_attribute("start"), fixed, "{}", variable.name);
            if let (Some(min), Some(max)) = (number(values, "min"), number(values, "max")) {
                let start = number(values, "start").expect("a start");
                assert!(min <= start && start <= max, "{}: {min} {start} {max}", variable.name);
            }
            if variable.is_output() {
                outputs.insert(if version == Version::Two { place + 1 } else { reference });
            }
            clocked += usize::from(node.has_attribute("clocks"));
        }
        let (output, unknown, key) = if version == Version::Two {
            ("Outputs", "InitialUnknowns", "index")
        } else {
            ("Output", "InitialUnknown", "valueReference")
        };
        let listed = |name: &str| -> BTreeSet<usize> {
            let nodes = find(name);
            let nodes: Vec<_> = if version == Version::Two {
                nodes[0].children().filter(roxmltree::Node::is_element).collect()
            } else {
                nodes
            };
            nodes.iter().map(|node| whole(*node, key)).collect()
        };
        assert_eq!(listed(output), outputs);
        assert!(listed(unknown).is_subset(&outputs) && !listed(unknown).is_empty());
        let ability = if version == Version::Two { "canGetAndSetFMUstate" } else { "canGetAndSetFMUState" };
        assert_eq!(find("CoSimulation")[0].attribute(ability), Some("true"));
        let clocks = find("Clock");
        assert_eq!(clocks.len(), usize::from(version == Version::Three && part == Part::Drive));
        if let Some(clock) = clocks.first() {
            assert_eq!(clock.attribute("intervalVariability"), Some("constant"));
            assert_eq!(number(*clock, "intervalDecimal"), Some(80e-6));
            assert_eq!(clocked, 6 + 12);
        }
        assert_eq!(number(find("DefaultExperiment")[0], "stepSize"), Some(80e-6));
        // One of each kind of parameter, by its number.
        let parameter = |name: &str| {
            model.variables.iter().find(|variable| variable.name == name).and_then(|of| of.start)
        };
        assert_eq!(parameter("seed"), Some(7.0));
        assert!(parameter("motor.winding.resistance").is_some_and(|resistance| resistance > 0.0));
        assert_eq!(parameter("inverter.dead_time").is_some(), part == Part::Drive);
        assert_eq!(parameter("rotor.draw_angle"), Some(1.0));
    }
}

/// A name with `true` in it is none that a Modelica tool can make a component of.
#[test]
fn law_no_part_of_a_name_is_a_keyword_of_modelica_or_c() {
    const MODELICA: &str = "algorithm and annotation block break class connect connector constant constrainedby der discrete each \
        else elseif elsewhen encapsulated end enumeration equation expandable extends external false final flow for function if import \
        impure in initial inner input loop model not operator or outer output package parameter partial protected public pure record \
        redeclare replaceable return stream then true type when while within";
    const C: &str = "auto bool break case char const continue default do double else enum extern float for goto if inline int long \
        register restrict return short signed sizeof static struct switch typedef union unsigned void volatile while true false \
        nullptr class new delete this public private";
    let keywords: BTreeSet<&str> = MODELICA.split_whitespace().chain(C.split_whitespace()).collect();
    let shunt = format!(
        "{FIELD}\ndetector.method = \"bipolar\"\nsensors.arrangement = \"dc-link-shunt\"\nsensors.terminals = true"
    );
    let mut tried = 0;
    for (text, part) in [(FIELD, Part::Drive), (shunt.as_str(), Part::Drive), (FIELD, Part::Motor)] {
        let model = unpacked(text, part).model;
        for version in [Version::Two, Version::Three] {
            let text = model.description(version);
            let xml = Xml::parse(&text).expect("XML");
            for node in
                xml.descendants().filter(|node| node.has_attribute("name") && !node.has_tag_name("Unit"))
            {
                let name = node.attribute("name").expect("one");
                // The names of its items and types, too; units and categories are texts.
                if node.has_tag_name("DisplayUnit") || node.has_tag_name("Category") {
                    continue;
                }
                for word in name.split('.') {
                    let letters = word.starts_with(|c: char| c.is_ascii_alphabetic())
                        && word.chars().all(|c| c.is_ascii_alphanumeric() || c == '_');
                    assert!(letters && !keywords.contains(word), "{name}");
                    tried += 1;
                }
            }
        }
    }
    assert!(tried > 500, "{tried}");
}

/// In FMI 2.0 they are integers, for some importers, such as libcosim, set no enumeration.
#[test]
fn law_modes_are_an_enumeration_of_fmi_3_whose_numbers_are_those_of_the_header_for_c() {
    let model = unpacked(FIELD, Part::Drive).model;
    let text = model.description(Version::Three);
    let xml = Xml::parse(&text).expect("XML");
    let find = |name: &'static str| xml.descendants().filter(move |node| node.has_tag_name(name));
    let items: Vec<_> =
        find("Item").map(|item| (item.attribute("name").expect("one"), whole(item, "value"))).collect();
    assert_eq!(items, [("off", 0), ("low", 1), ("high", 2), ("duty", 3)]);
    for (name, value) in &items {
        let line = format!("    STS_{} = {value},", name.to_uppercase());
        assert!(standstill_foreign::HEADER.contains(&line), "{line}");
    }
    let typed: Vec<_> = find("Enumeration").filter_map(|node| node.attribute("declaredType")).collect();
    assert_eq!(typed, ["Mode"; 3]);
    assert_eq!(
        find("EnumerationType").filter_map(|node| node.attribute("name")).collect::<Vec<_>>(),
        ["Mode"]
    );
    let text = model.description(Version::Two);
    let xml = Xml::parse(&text).expect("XML");
    let modes =
        xml.descendants().filter(|node| node.attribute("name").is_some_and(|name| name.starts_with("mode_")));
    let limits = modes.map(|node| {
        let values = node.first_element_child().expect("values");
        assert!(values.has_tag_name("Integer") && !values.has_attribute("declaredType"));
        (number(values, "min"), number(values, "max"))
    });
    assert_eq!(limits.collect::<Vec<_>>(), [(Some(0.0), Some(3.0)); 3]);
    for (part, version) in [(Part::Drive, Version::Two), (Part::Motor, Version::Three)] {
        assert!(!unpacked(FIELD, part).model.description(version).contains("TypeDefinitions"));
    }
}

/// A library that counts variables otherwise would read one in place of another.
#[test]
fn regress_the_token_is_of_the_variables_too() {
    let mut model = unpacked(FIELD, Part::Drive).model;
    let token = model.token();
    model.variables.swap(10, 11);
    assert_ne!(model.token(), token, "another order");
    model.variables.swap(10, 11);
    assert_eq!(model.token(), token);
    model.variables[0].kind = Kind::Integer;
    assert_ne!(model.token(), token, "another kind");
}

/// A dead time that a run refuses is none of an FMU, and none in its description.
#[test]
fn law_a_dead_time_leaves_the_pwm_room() {
    let model = |text: &str, part| {
        let document = Document::parse(Path::new("s.toml"), text).expect("TOML");
        standstill_fmu::Model::new(&document, part).map_err(|error| error.to_string())
    };
    let with = |dead: &str| format!("inverter = {{ carrier = \"10 kHz\", dead_time = \"{dead}\" }}");
    let drive = model(&with("24999 ns"), Part::Drive).expect("a quarter of 100 µs is 25 µs");
    let dead = drive.variables.iter().find(|variable| variable.name == "inverter.dead_time").expect("one");
    assert_eq!(dead.limits, Some([0.0, 24.999e-6]));
    let refused = model(&with("25 us"), Part::Drive).expect_err("refused");
    assert_eq!(
        refused,
        "s.toml: line 1: `inverter.dead_time`: found 25 µs, needed from 0 to 24.999 µs: less than a quarter of the PWM period of 100 µs"
    );
    // A motor alone has none.
    assert!(model(&with("25 us"), Part::Motor).is_ok());
}

/// The page lists the parameters of all FMUs. With `STANDSTILL_WRITE=1` this writes them.
#[test]
fn golden_the_page_lists_the_parameters() {
    let mut listed: Vec<String> = Vec::new();
    let mut table = "| parameter | unit | allowed | meaning |\n|---|---|---|---|\n".to_owned();
    let hot = "rotor = { state = \"free\", winding_temperature = 20, magnet_temperature = 20 }";
    let storing = "inverter = { capacitance = \"1 mF\", source_resistance = \"1 ohm\", sag_depth = 0.1, sag_duration = \"1 ms\" }";
    for (text, part) in [
        (format!("errors = \"field\"\n{hot}\n{storing}"), Part::Drive),
        (
            format!("{hot}\ninverter = {{ devices = \"mosfet\", terminal_capacitance = \"0.3 nF\" }}"),
            Part::Drive,
        ),
        (hot.to_owned(), Part::Motor),
    ] {
        for variable in unpacked(&text, part).model.variables {
            if !variable.is_parameter() || listed.contains(&variable.name) {
                continue;
            }
            let allowed = if variable.kind == Kind::Boolean { "true or false" } else { &variable.allowed };
            let about = variable.about.trim_end_matches('.');
            let _ = writeln!(table, "| `{}` | {} | {allowed} | {about} |", variable.name, variable.unit);
            listed.push(variable.name);
        }
    }
    assert!(listed.len() > 45, "{listed:?}");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/fmi.md");
    let page = std::fs::read_to_string(path).expect("the page");
    let (head, rest) = page.split_once("## All parameters\n").expect("their heading");
    let (shown, tail) = rest.split_once("\n## ").expect("a heading after it");
    let (said, _) = shown.split_once("| parameter").unwrap_or((shown, ""));
    let should = format!("{}\n\n{table}", said.trim_end());
    if std::env::var_os("STANDSTILL_WRITE").is_some() {
        std::fs::write(path, format!("{head}## All parameters\n{should}\n## {tail}")).expect("writable");
        return;
    }
    for (is, should) in shown.lines().zip(should.lines()) {
        assert_eq!(is, should);
    }
    assert_eq!(shown.lines().count(), should.lines().count());
}

#[test]
fn law_a_motor_with_a_map_carries_it_along() {
    let folder = tempfile::tempdir().expect("a folder");
    let map = map_text();
    std::fs::write(folder.path().join("map.csv"), &map).expect("written");
    let sheet = standstill_plant::DataSheet::built_in_text("paper-5k5").expect("built in");
    let (head, rest) = sheet.split_once("[saturation]").expect("a table");
    let rotor = &rest[rest.find("[rotor]").expect("a table")..];
    let own = format!("{head}[map]\nfile = \"map.csv\"\n{rotor}");
    std::fs::write(folder.path().join("own.toml"), own).expect("written");
    let document = Document::parse(&folder.path().join("s.toml"), "motor = \"own.toml\"").expect("TOML");
    let model = standstill_fmu::Model::new(&document, Part::Motor).expect("a model");
    assert_eq!(model.packed.files.len(), 1);
    assert_eq!((model.packed.files[0].0.as_str(), &*model.packed.files[0].1), ("map.csv", map.as_bytes()));
    assert!(!model.packed.text.contains(&*folder.path().to_string_lossy()), "{}", model.packed.text);
    // Elsewhere, without the first folder, it is the same motor.
    let there = super::importer::at(model);
    drop(folder);
    let slave = super::importer::Slave::ready(&there, &[]);
    assert_eq!((slave.set("u_a", 10.0), slave.step(0.0, 1e-3)), (0, 0), "{}", slave.said());
    assert!(slave.get("i_a").abs() > 0.1);
}

/// A map of linear inductances with a magnet.
fn map_text() -> String {
    let mut text = "i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n".to_owned();
    for d in -10..=10 {
        for q in -10..=10 {
            let (d, q) = (f64::from(d) * 2.0, f64::from(q) * 2.0);
            let _ = writeln!(text, "{d},{q},{},{}", 0.45 + 1.065e-2 * d, 1.69e-2 * q);
        }
    }
    text
}
