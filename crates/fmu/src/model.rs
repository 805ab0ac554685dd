//! Model of an FMU: a scenario's drive or its motor alone, and its variables.

use std::path::Path;

use standstill_interface::Nanos;
use standstill_plant::{Files, Motor};
use standstill_scenario::{Document, FileError, Packed, Scenario};
use thiserror::Error;

use crate::units::readable;
use crate::variables::{Variable, add_samples, dead_time, variables};

/// Content: a drive or a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Inverter, motor and sensors; legs go in.
    Drive,
    /// The motor alone; voltages go in.
    Motor,
}

/// The resource with the number of samples of a step, where there are several.
const SAMPLES: &str = "samples-of-a-step.txt";

/// Most samples of a step.
pub const MOST_SAMPLES: u32 = 16;

/// Key of the resolver's error, which an FMU does not have.
pub(crate) const RESOLVER: &str = "sensors.resolver_error";

impl Part {
    /// Returns the name: that of the binary, and of the scenario in the resources.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Drive => "standstill_drive",
            Self::Motor => "standstill_motor",
        }
    }

    /// Returns the tables and single keys of a scenario that concern this part.
    pub const fn keys(self) -> &'static [&'static str] {
        match self {
            Self::Drive => &["motor", "rotor", "inverter", "sensors", "errors", "seed"],
            // The communication step that importers are advised to take is a PWM period.
            Self::Motor => &["motor", "rotor", "inverter.carrier", "seed"],
        }
    }

    /// Returns true if a key of a scenario concerns this part.
    pub fn has_use_for(self, key: &str) -> bool {
        self.keys()
            .iter()
            .any(|known| key.strip_prefix(known).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
    }

    /// Returns the file among the resources that has the scenario.
    pub(crate) fn resource(self) -> String {
        format!("{}.toml", self.name())
    }
}

/// Version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// 2.0, which all tools import.
    Two,
    /// 3.0, with a clock for the PWM period.
    Three,
}

/// A scenario as an FMU has it.
#[derive(Debug)]
pub struct Model {
    /// Content: a drive or a motor.
    pub part: Part,
    /// The scenario, which needs no file but those of [`Model::packed`].
    pub(crate) document: Document,
    /// Files for the resources.
    pub packed: Packed,
    /// Variables; the index of each is its value reference.
    pub variables: Vec<Variable>,
    /// Name of the motor.
    pub motor: String,
    /// Samples of a communication step.
    pub(crate) samples: u32,
    /// Period of the PWM carrier.
    period: Nanos,
    /// Flux linkage at rated current in Wb, to which tolerances are relative.
    pub(crate) flux: f64,
    /// The numerical tolerance of a step, relative to it.
    pub(crate) tolerance: f64,
}

/// Errors of an export.
#[derive(Debug, Error)]
pub enum ModelError {
    /// The scenario.
    #[error(transparent)]
    Scenario(#[from] FileError),
    /// A value that FMI has no room for.
    #[error("{0}")]
    Value(String),
}

/// Basis of [`hash`].
pub(crate) const BASIS: u64 = 0xcbf2_9ce4_8422_2325;

/// Hash of bytes by Fowler, Noll and Vo.
pub(crate) fn hash(basis: u64, bytes: impl Iterator<Item = u8>) -> u64 {
    bytes.fold(basis, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

impl Model {
    /// Makes the model of a document: motor, drive, sensors and rotor, without the detector.
    ///
    /// ```
    /// use standstill_fmu::{Model, Part};
    /// use standstill_scenario::Document;
    ///
    /// let document = Document::parse("s.toml".as_ref(), "motor = \"low-inertia\"")?;
    /// let model = Model::new(&document, Part::Motor)?;
    /// assert!(model.variables.iter().any(|variable| variable.name == "torque"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// A scenario that cannot be, one that has axes or tolerances, a drive with an error of the resolver, and a seed beyond 32 bits.
    pub fn new(document: &Document, part: Part) -> Result<Self, ModelError> {
        let packed = document.packed()?;
        let mut document = document.clone();
        document.remove("detector");
        let file = document.load_single()?;
        let motor = document.motor()?;
        let scenario = document.unchecked_scenario_of(&motor)?;
        let (longest, needed) = dead_time(scenario.drive.carrier_period);
        if part == Part::Drive && scenario.drive.dead_time > longest {
            let found = readable(scenario.drive.dead_time.seconds(), "s");
            return Err(document.refuse("inverter.dead_time", &found, &needed).into());
        }
        // The resolver stands for the measured angle in traces alone. Sets of errors have one for them; who names it wants its effect.
        let resolver = document.get(RESOLVER).filter(|_| scenario.sensors.resolver.error > 0.0);
        if let (Part::Drive, Some(value)) = (part, resolver) {
            let found = format!("{value} in an FMU, which has no resolver");
            let needed = "0 or no such key; its `actual.angle` is without error";
            return Err(document.refuse(RESOLVER, &found, needed).into());
        }
        if i32::try_from(file.seed).is_err() {
            let seed = file.seed;
            return Err(ModelError::Value(format!(
                "`seed`: found {seed}, needed at most {}: integers of FMI 2.0 have 32 bits",
                i32::MAX
            )));
        }
        let flux =
            motor.winding.d_axis_inductance().min(motor.winding.q_axis_inductance()) * motor.rated_current;
        Ok(Self {
            part,
            flux,
            tolerance: scenario.tolerance.flux / flux,
            variables: variables(part, &document, &packed, &scenario, &motor),
            packed,
            samples: 1,
            motor: motor.name.clone(),
            period: scenario.drive.carrier_period,
            document,
        })
    }

    /// With so many samples in each communication step, from 2 to 16.
    ///
    /// ```
    /// use standstill_fmu::{Model, Part};
    /// use standstill_scenario::Document;
    ///
    /// let document = Document::parse("s.toml".as_ref(), "motor = \"low-inertia\"")?;
    /// let model = Model::new(&document, Part::Drive)?.with_samples(4)?;
    /// assert!(model.variables.iter().any(|variable| variable.name == "sampled_4.i_a"));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Another number, and a motor alone, which samples nothing.
    pub fn with_samples(mut self, samples: u32) -> Result<Self, ModelError> {
        if !(2..=MOST_SAMPLES).contains(&samples) {
            return Err(ModelError::Value(format!(
                "samples of a step: found {samples}, needed from 1 to {MOST_SAMPLES}"
            )));
        }
        if self.part == Part::Motor {
            return Err(ModelError::Value(format!(
                "samples of a step: found {samples} of a motor alone, which has no converters; needed: `--part drive`, or none"
            )));
        }
        add_samples(&mut self.variables, samples);
        self.packed.files.push((SAMPLES.to_owned(), samples.to_string().into_bytes().into()));
        self.samples = samples;
        Ok(self)
    }

    /// Reads a model from the resources of an FMU. No file outside of their folder is read.
    ///
    /// # Errors
    /// The resources are missing or of another version.
    pub(crate) fn unpacked(resources: &Path) -> Result<Self, String> {
        for part in [Part::Drive, Part::Motor] {
            let path = resources.join(part.resource());
            if path.exists() {
                let read = |path: &Path| -> Result<(Document, String), FileError> {
                    let text = Files::default().text(path).map_err(|error| FileError::Read {
                        file: path.to_owned(),
                        error: error.to_string(),
                    })?;
                    let mut document = Document::parse(path, &text)?;
                    document.fence(Some(resources))?;
                    Ok((document, text))
                };
                let (document, text) = read(&path).map_err(|error| error.to_string())?;
                let mut model = Self::new(&document, part).map_err(|error| error.to_string())?;
                // Files of a motor's map have names of their own kind.
                let samples = resources.join(SAMPLES);
                if samples.exists() {
                    let text = Files::default().text(&samples).map_err(|error| error.to_string())?;
                    let count = text.trim().parse().map_err(|_| {
                        format!("{}: found {text}, needed from 2 to {MOST_SAMPLES}", samples.display())
                    })?;
                    model = model.with_samples(count).map_err(|error| error.to_string())?;
                }
                // What is there counts, and not in which order it would be written again.
                model.packed.text = text;
                return Ok(model);
            }
        }
        let expected = [Part::Drive, Part::Motor].map(Part::resource).join(" or ");
        Err(format!("{}: found no scenario, needed {expected}", resources.display()))
    }

    /// Makes the scenario with the motor of the document.
    pub(crate) fn scenario_of(
        document: &Document,
    ) -> Result<Scenario<standstill_detect::Method<f64>>, FileError> {
        let motor: Motor = document.motor()?;
        document.unchecked_scenario_of(&motor)
    }

    /// Returns the period of the PWM carrier.
    pub fn period(&self) -> Nanos {
        self.period
    }

    /// Returns the PWM period for people, with all digits: a communication step may be off it by a nanosecond.
    pub fn period_text(&self) -> String {
        readable(self.period.seconds(), "s")
    }

    /// Returns the digest of the model: part, version of the program, variables and content of the resources. A library
    /// with a different list of variables is therefore refused.
    pub fn token(&self) -> String {
        let words = [self.part.name(), env!("CARGO_PKG_VERSION"), &self.packed.text];
        let [high, low] = [BASIS, BASIS.rotate_left(32)].map(|basis| {
            let texts = words.iter().flat_map(|word| word.bytes().chain([0]));
            let kinds = self.variables.iter().flat_map(|of| of.name.bytes().chain([of.kind as u8]));
            let files =
                self.packed.files.iter().flat_map(|(name, bytes)| name.bytes().chain(bytes.iter().copied()));
            hash(basis, texts.chain(kinds).chain(files))
        });
        let [a, b, c] = [high >> 32, high >> 16 & 0xffff, high & 0xffff];
        format!("{{{a:08x}-{b:04x}-{c:04x}-{:04x}-{:012x}}}", low >> 48, low & 0xffff_ffff_ffff)
    }
}
