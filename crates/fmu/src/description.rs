//! `modelDescription.xml`.

use std::collections::BTreeSet;
use std::fmt::Write as _;

use standstill_quantity::rounded;

use crate::model::{Model, Part, Version};
use crate::units;
use crate::variables::{Kind, MODES, Role, Variable};

/// The name of the enumeration of a leg's modes.
const MODE: &str = "Mode";

/// Returns a text within an attribute, or between tags.
pub(crate) fn escaped(text: &str) -> String {
    let entities = [("&", "&amp;"), ("<", "&lt;"), (">", "&gt;"), ("\"", "&quot;")];
    let text = entities.iter().fold(text.to_owned(), |text, (of, entity)| text.replace(of, entity));
    text.replace(['\n', '\r', '\t'], " ")
}

/// Returns attributes of XML; those without value are left out.
fn attributes(pairs: &[(&str, Option<String>)]) -> String {
    let mut text = String::new();
    for (name, value) in pairs {
        if let Some(value) = value {
            let _ = write!(text, " {name}=\"{}\"", escaped(value));
        }
    }
    text
}

impl Variable {
    /// Returns a value as its kind writes it.
    fn written(&self, value: f64) -> String {
        match self.kind {
            Kind::Real => format!("{value:?}"),
            Kind::Boolean | Kind::Clock => (value != 0.0).to_string(),
            Kind::Integer | Kind::Mode => format!("{value}"),
        }
    }

    fn causality(&self) -> &'static str {
        match self.role {
            Role::Time => "independent",
            _ if self.is_parameter() => "parameter",
            _ if self.is_input() => "input",
            _ => "output",
        }
    }

    fn variability(&self) -> &'static str {
        match self.role {
            Role::Voltage(_) | Role::True(_) | Role::Time => "continuous",
            _ if self.is_parameter() => "fixed",
            _ => "discrete",
        }
    }

    fn initial(&self) -> Option<&'static str> {
        match self.role {
            _ if self.is_parameter() => Some("exact"),
            _ if self.is_output() => Some("calculated"),
            _ => None,
        }
    }

    /// Returns the unit, limits and start as attributes.
    fn numbers(&self, version: Version) -> String {
        let unit = units::unit(&self.unit).filter(|unit| self.kind == Kind::Real && !unit.symbol.is_empty());
        let limit = |end: usize| {
            self.limits.filter(|_| self.kind != Kind::Boolean).map(|ends| self.written(ends[end]))
        };
        attributes(&[
            ("declaredType", (self.kind == Kind::Mode && version == Version::Three).then(|| MODE.to_owned())),
            ("unit", unit.map(|unit| unit.name.to_owned())),
            ("displayUnit", unit.and_then(|unit| unit.shown).map(|(name, _)| name.to_owned())),
            ("min", limit(0)),
            ("max", limit(1)),
            ("start", self.start.map(|start| self.written(start))),
        ])
    }
}

impl Kind {
    /// Returns the name of its elements.
    fn element(self, version: Version) -> &'static str {
        match (self, version) {
            (Self::Real, Version::Two) => "Real",
            (Self::Real, Version::Three) => "Float64",
            // Some importers of FMI 2.0, such as libcosim, set no enumerations.
            (Self::Integer | Self::Mode, Version::Two) => "Integer",
            (Self::Integer, Version::Three) => "Int32",
            (Self::Mode, Version::Three) => "Enumeration",
            (Self::Boolean, _) => "Boolean",
            (Self::Clock, _) => "Clock",
        }
    }
}

impl Model {
    /// Returns the description by which an importer knows the FMU.
    pub fn description(&self, version: Version) -> String {
        let (two, drive) = (version == Version::Two, self.part == Part::Drive);
        let (number, token, more) = match version {
            Version::Two => ("2.0", "guid", " numberOfEventIndicators=\"0\""),
            Version::Three => ("3.0", "instantiationToken", ""),
        };
        let period = self.period().seconds();
        let abilities = match version {
            Version::Two => vec![
                ("canHandleVariableCommunicationStepSize", Some((!drive).to_string())),
                ("canNotUseMemoryManagementFunctions", Some("true".to_owned())),
                ("canGetAndSetFMUstate", Some("true".to_owned())),
                ("canSerializeFMUstate", Some("true".to_owned())),
            ],
            Version::Three => vec![
                ("canGetAndSetFMUState", Some("true".to_owned())),
                ("canSerializeFMUState", Some("true".to_owned())),
                ("canHandleVariableCommunicationStepSize", Some((!drive).to_string())),
                ("fixedInternalStepSize", drive.then(|| format!("{period:?}"))),
                ("hasEventMode", Some(drive.to_string())),
            ],
        };
        let clock = self.variables.iter().position(|variable| variable.kind == Kind::Clock);
        let (mut variables, mut outputs, mut unknowns) = (Vec::new(), Vec::new(), Vec::new());
        for (place, (reference, variable)) in (1..).zip(self.listed(version)) {
            let clocked = clock.filter(|_| !two && variable.is_clocked());
            let common = attributes(&[
                ("name", Some(variable.name.clone())),
                ("valueReference", Some(reference.to_string())),
                ("description", Some(variable.about.clone())),
                ("causality", Some(variable.causality().to_owned())),
                ("variability", Some(variable.variability().to_owned())),
                ("clocks", clocked.map(|clock| clock.to_string())),
                ("initial", variable.initial().map(str::to_owned)),
            ]);
            let numbers = match variable.kind {
                Kind::Clock => {
                    format!(" intervalVariability=\"constant\" intervalDecimal=\"{period:?}\"")
                }
                _ => variable.numbers(version),
            };
            let kind = variable.kind.element(version);
            variables.push(if two {
                format!("    <ScalarVariable{common}><{kind}{numbers}/></ScalarVariable>\n")
            } else {
                format!("    <{kind}{common}{numbers}/>\n")
            });
            if variable.is_output() {
                // What goes in shows a step later.
                outputs.push(if two {
                    format!("      <Unknown index=\"{place}\" dependencies=\"\"/>\n")
                } else {
                    format!("    <Output valueReference=\"{reference}\" dependencies=\"\"/>\n")
                });
                if two {
                    unknowns.push(format!("      <Unknown index=\"{place}\"/>\n"));
                } else if clocked.is_none() {
                    unknowns.push(format!("    <InitialUnknown valueReference=\"{reference}\"/>\n"));
                }
            }
        }
        let (variables, mut outputs, mut unknowns) =
            (variables.concat(), outputs.concat(), unknowns.concat());
        if two {
            outputs = format!("    <Outputs>\n{outputs}    </Outputs>\n");
            unknowns = format!("    <InitialUnknowns>\n{unknowns}    </InitialUnknowns>\n");
        }
        [
            "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<fmiModelDescription",
            &self.head(number, token),
            more,
            ">\n  <CoSimulation modelIdentifier=\"",
            self.part.name(),
            "\"",
            &attributes(&abilities),
            "/>\n",
            &self.units(),
            &self.types(version),
            "  <LogCategories><Category name=\"error\" description=\"What went wrong\"/></LogCategories>\n",
            &self.experiment(),
            "  <ModelVariables>\n",
            &variables,
            "  </ModelVariables>\n  <ModelStructure>\n",
            &outputs,
            &unknowns,
            "  </ModelStructure>\n</fmiModelDescription>\n",
        ]
        .concat()
    }

    fn about(&self) -> String {
        match self.part {
            Part::Drive => format!("Inverter, motor {} and sensors: legs in, samples out", self.motor),
            Part::Motor => format!("Motor {}: voltages in, currents and torque out", self.motor),
        }
    }

    fn head(&self, version: &str, token: &str) -> String {
        attributes(&[
            ("fmiVersion", Some(version.to_owned())),
            ("modelName", Some(format!("{}.{}", self.part.name(), self.motor))),
            (token, Some(self.token())),
            ("description", Some(self.about())),
            ("version", Some(env!("CARGO_PKG_VERSION").to_owned())),
            ("generationTool", Some(concat!("Standstill ", env!("CARGO_PKG_VERSION")).to_owned())),
            ("variableNamingConvention", Some("structured".to_owned())),
        ])
    }

    /// Returns a PWM period; a motor alone has none, and takes the same as a proposal.
    fn experiment(&self) -> String {
        let step = self.period().seconds();
        // Whole steps of about 20 ms: the last one, too, is one that a drive takes.
        let stop = (0.02 / step).round().max(1.0) * step;
        format!(
            "  <DefaultExperiment startTime=\"0\" stopTime=\"{stop:?}\" tolerance=\"{:?}\" stepSize=\"{step:?}\"/>\n",
            rounded(self.tolerance, 0)
        )
    }

    /// Returns the enumeration of a leg's modes; empty if the model has no legs or importers do not accept the
    /// version's enumerations.
    fn types(&self, version: Version) -> String {
        if self.part == Part::Motor || version == Version::Two {
            return String::new();
        }
        let mut items = String::new();
        for (value, (name, about)) in MODES.iter().enumerate() {
            let about = escaped(about);
            let _ =
                writeln!(items, "      <Item name=\"{name}\" value=\"{value}\" description=\"{about}\"/>");
        }
        let inside = format!("    <EnumerationType name=\"{MODE}\">\n{items}    </EnumerationType>\n");
        format!("  <TypeDefinitions>\n{inside}  </TypeDefinitions>\n")
    }

    fn units(&self) -> String {
        let used: BTreeSet<&str> = self.variables.iter().map(|variable| variable.unit.as_str()).collect();
        let mut text = "  <UnitDefinitions>\n".to_owned();
        for unit in used.into_iter().filter(|symbol| !symbol.is_empty()).filter_map(units::unit) {
            let mut base = String::new();
            for (name, exponent) in unit.base {
                let _ = write!(base, " {name}=\"{exponent}\"");
            }
            if unit.factor != 1.0 {
                let _ = write!(base, " factor=\"{:?}\"", unit.factor);
            }
            if unit.offset != 0.0 {
                let _ = write!(base, " offset=\"{:?}\"", unit.offset);
            }
            let shown = unit.shown.map_or(String::new(), |(name, factor)| {
                format!("<DisplayUnit name=\"{name}\" factor=\"{factor:?}\"/>")
            });
            let _ = writeln!(text, "    <Unit name=\"{}\"><BaseUnit{base}/>{shown}</Unit>", unit.name);
        }
        text + "  </UnitDefinitions>\n"
    }

    /// Variables with their value references. FMI 2.0 has no clock and needs no time.
    fn listed(&self, version: Version) -> impl Iterator<Item = (usize, &Variable)> {
        let has = move |variable: &Variable| {
            version == Version::Three || !matches!(variable.role, Role::Time | Role::Clock)
        };
        self.variables.iter().enumerate().filter(move |(_, variable)| has(variable))
    }
}
