//! The documentation page in an FMU: inputs, outputs, communication steps and all parameters.

use std::fmt::Write as _;

use crate::description::escaped;
use crate::model::{Model, Part, Version};
use crate::variables::{Kind, MODES, Variable};

const STYLE: &str = "body{font:16px/1.5 sans-serif;max-width:60rem;margin:1rem auto;padding:0 1rem;color-scheme:light dark}\
div{overflow-x:auto}table{border-collapse:collapse}td,th{border:1px solid #8888;padding:.2rem .6rem;text-align:left;vertical-align:top}";

impl Model {
    /// Returns `documentation/index.html` of an FMU with libraries for these kinds of machines.
    pub(crate) fn documentation(&self, version: Version, machines: &[&str]) -> String {
        let drive = self.part == Part::Drive;
        let title = format!("{} {}", if drive { "Drive with motor" } else { "Motor" }, escaped(&self.motor));
        let number = if version == Version::Two { "2.0" } else { "3.0" };
        let mut page = format!(
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" content=\"width=device-width\">\
             <title>{title}</title><style>{STYLE}</style><h1>{title}</h1>\
             <p>FMI {number} for co-simulation, written by Standstill {}. It runs on {}.</p>\n",
            env!("CARGO_PKG_VERSION"),
            machines.join(", ")
        );
        page += &self.steps();
        let listed = |is: fn(&Variable) -> bool| -> Vec<&Variable> {
            self.variables.iter().filter(|of| is(of) && of.kind != Kind::Clock).collect()
        };
        page += &table("Inputs", &listed(Variable::is_input));
        page += &table("Outputs", &listed(Variable::is_output));
        page += &table("Parameters", &listed(Variable::is_parameter));
        let _ = writeln!(
            page,
            "<h2>Tolerance</h2><p>A step has a numerical error of at most {:.0e} of the flux at rated current. A smaller tolerance that \
             the importer sets makes it smaller, a larger one changes nothing.</p>",
            self.tolerance
        );
        page + "</html>\n"
    }

    fn steps(&self) -> String {
        let period = self.period_text();
        if self.part == Part::Motor {
            return "<h2>Steps</h2><p>Of any length from 1 ns on; the potentials are held within a step.</p>\n".to_owned();
        }
        let mut text = format!(
            "<h2>Steps</h2><p>The communication step is {period}, a period of the PWM, or half of that. Any other step is an error. Set \
             the importer's fixed step to {:?} s.</p><h2>Modes of a leg</h2><div><table><tr><th>number</th><th>name</th><th>meaning</th></tr>",
            self.period().seconds()
        );
        for (number, (name, about)) in MODES.iter().enumerate() {
            let _ = write!(text, "<tr><td>{number}</td><td>{name}</td><td>{}</td></tr>", escaped(about));
        }
        text + "</table></div>\n"
    }
}

fn table(title: &str, variables: &[&Variable]) -> String {
    let mut text = format!(
        "<h2>{title}</h2><div><table><tr><th>name</th><th>unit</th><th>start</th><th>allowed</th><th>meaning</th></tr>\n"
    );
    for of in variables {
        let start = match (of.start, of.kind) {
            (None, _) => String::new(),
            (Some(start), Kind::Boolean) => (start != 0.0).to_string(),
            (Some(start), _) => start.to_string(),
        };
        let allowed = match of.kind {
            _ if of.start.is_none() => "",
            Kind::Boolean => "true or false",
            _ => &of.allowed,
        };
        let _ = writeln!(
            text,
            "<tr><td><code>{}</code></td><td>{}</td><td>{start}</td><td>{}</td><td>{}</td></tr>",
            escaped(&of.name),
            escaped(&of.unit),
            escaped(allowed),
            escaped(&of.about)
        );
    }
    text + "</table></div>\n"
}
