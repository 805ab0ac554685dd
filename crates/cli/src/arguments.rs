//! The command line.

mod campaigns;
mod folder;
mod groups;
mod motors;
mod scenario;
mod slurm;
mod values;

use std::path::PathBuf;
use std::sync::LazyLock;

use clap::{Args, Parser, Subcommand};
use standstill_analysis::Effort;
use standstill_campaign::NUMERICS;
use standstill_detect::{Decay, MethodName, Signature};
use standstill_foreign::ABI;
use standstill_scenario::{ErrorSet, PoleRule, Rotor};
use standstill_table::Format;

#[cfg(feature = "program")]
pub use campaigns::Completions;
pub use campaigns::{
    Amount, Bounds, Budget, Explain, Faults, Init, Lab, MOST_AT_A_VALUE, Man, Merge, Odds, Qualify, Question,
    Report, Require, Results, Rows, Run, Status, Sweep, Tune, Witness,
};
pub use folder::default_folder;
pub use motors::{Convert, Fit, Magnetics, Motors};
#[cfg(feature = "program")]
pub use motors::{Fmu, FmuPart};
pub use scenario::{Axes, Keys, Load, Seed, Setup, Source, Temperatures};
pub use slurm::Slurm;
pub use values::{FOLDERS, Force};
use values::{MOST_ROWS, OUT, amperes, choice, degrees, milliseconds, papers, tolerance, trial, whole};

/// Text of `--version`. It has three versions: that of the program, that of the numerics, and that of the detector ABI. A run can be
/// resumed only with the same version of the numerics. The version of the ABI decides which detector libraries are compatible.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let version = env!("CARGO_PKG_VERSION");
    format!("{version} (numerics {NUMERICS}, ABI of detectors {ABI})")
});

/// Test bench for initial rotor position detection of permanent-magnet synchronous motors.
#[derive(Debug, Parser)]
#[command(name = "standstill", version = VERSION.as_str(), help_template = groups::HELP.as_str(), subcommand_required = true, arg_required_else_help = true)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Reproduce the paper: audit its tables, simulate them, and compute the angle error of its method over all rotor angles
    #[cfg(feature = "program")]
    Reproduce(Reproduce),
    /// One detection, every waveform
    Trace(Trace),
    /// All methods on one motor, side by side: errors, wrong poles, time, current, and the limit that physics sets
    Compare(Compare),
    /// Whether this motor is suited to detection at standstill, with which method and which margin
    Check(Check),
    /// A scenario file's trials, at each point of its axes
    Run(Run),
    /// As `run`, with axes from the command line
    Sweep(Sweep),
    /// The probability of a rare event, down to one in a billion, and what it looks like
    Odds(Odds),
    /// What each failure mode of drive, sensors and motor leads to: wrong poles, and whether the method detects it
    Faults(Faults),
    /// Whether a list of requirements is met, each passed, failed or not shown, with the evidence for an assessor
    Qualify(Qualify),
    /// Closed forms, conservation laws and kept results, computed anew on this machine
    Witness(Witness),
    /// Where the error comes from: the share of each sensor and drive error and of each tolerance
    Budget(Budget),
    /// The requirement on a part: the largest or smallest value of a key with which limits hold
    Require(Require),
    /// Why trials of a finished run ended as they did: their draws, their waveforms, and each repeated without one of its errors
    Explain(Explain),
    /// The best settings: those with the smallest measure while limits hold
    Tune(Tune),
    #[cfg(feature = "program")]
    /// Drive or motor as a functional mock-up unit (FMI 2.0, 3.0), for Simulink, OpenModelica and other tools
    Fmu(Fmu),
    /// Merge the shards of a run
    Merge(Merge),
    /// A script that runs a scenario file's shards on a cluster with Slurm, and puts them together
    #[cfg(feature = "program")]
    Slurm(Slurm),
    /// Which shards of a run are done, and which to submit again
    Status(Status),
    /// The Cramér–Rao limit of a method's commands over the rotor's angle: no unbiased estimate from the same readings is more exact
    Bounds(Bounds),
    /// A finished run as one HTML file, and its figures
    #[cfg(feature = "program")]
    Report(Report),
    /// A page in the browser: move the rotor, turn any key, and see one detection and ten thousand at once
    #[cfg(feature = "program")]
    Lab(Lab),
    /// An example of a scenario file, with every key, or a motor's data sheet to fill in
    #[cfg(feature = "program")]
    Init(Init),
    /// JSON Schema of scenario files, for editors
    #[cfg(feature = "program")]
    Schema,
    /// The completion script of a shell, on standard output
    #[cfg(feature = "program")]
    Completions(Completions),
    /// Man pages, one a command
    #[cfg(feature = "program")]
    Man(Man),
    /// A motor's inductances over current, and which pole draws more current
    Magnetics(Magnetics),
    /// A motor from scope traces of pulses at standstill: resistance, inductances, angle, saturation, with intervals
    Fit(Fit),
    /// A process for the trials of `run --isolate`, which starts it
    #[command(hide = true)]
    Worker,
    /// A motor's numbers as other data sheets give them: Kv, Ke, rms or peak, of a phase or between terminals
    Convert(Convert),
    /// The built-in motors, a line each; of one motor each number and its source
    Motors(Motors),
}

#[derive(Debug, Args)]
pub struct Reproduce {
    /// Another paper, whose statements are printed beside what this program computes; without it the paper of Chen and Tao (2019)
    #[arg(long, value_name = "NAME", value_parser = papers(), conflicts_with_all = ["scenario", "set", "detector", "decay", "trials", "motor", "errors", "rotor", "seed", "out", "force", "load", "winding_temperature", "magnet_temperature", "threads"])]
    pub paper: Option<String>,
    #[command(flatten)]
    pub source: Source,
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Trials of the Monte Carlo run [key: trials; without a scenario: 10000]
    #[arg(long, value_parser = whole::<u64>(1..=MOST_ROWS), allow_hyphen_values = true)]
    pub trials: Option<u64>,
    #[command(flatten)]
    pub decay: PaperDecay,
    #[command(flatten)]
    pub setup: Setup,
    /// Number of worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = whole::<u16>(1..=1024))]
    pub threads: Option<u16>,
}

/// Choice between the two decays of the pulses' current in the paper's method.
#[derive(Clone, Copy, Debug, Args)]
pub struct PaperDecay {
    /// Use the paper's method, with this decay of the current after each pulse: slow, by the zero vector, as in the paper, or fast, with
    /// all gates off [sets detector.method to line-inductance or line-inductance-fast; default without a scenario: slow]
    #[arg(long, value_parser = choice::<Decay>())]
    pub decay: Option<Decay>,
}

#[derive(Debug, Args)]
pub struct Trace {
    #[command(flatten)]
    pub source: Source,
    #[command(flatten)]
    pub axes: Axes,
    /// Point of the axes, from 0 as in summary.json; the last axis is walked along first
    #[arg(long, value_name = "P", default_value_t = 0, value_parser = whole::<usize>(0..=u64::MAX), allow_hyphen_values = true)]
    pub point: usize,
    /// Trial at that point, from 0 as in the trials' file: the same drive, sensors, tolerances, angle and noise
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = trial(), allow_hyphen_values = true)]
    pub trial: u64,
    /// Electrical rotor angle at the start, in degrees [key: rotor.angle; default: as the trial draws it]
    #[arg(long, value_name = "DEG", value_parser = degrees, allow_hyphen_values = true)]
    pub angle: Option<f64>,
    /// A method, with the signature of the poles by the motor's magnetics [key: detector.method; without a scenario: the paper's]
    #[arg(long, value_name = "NAME", value_parser = choice::<MethodName>(), conflicts_with = "decay")]
    pub method: Option<MethodName>,
    #[command(flatten)]
    pub decay: PaperDecay,
    #[command(flatten)]
    pub setup: Setup,
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Format of the files of the waveform and the events; `npz`: a NumPy archive, `mat`: a MATLAB file
    #[arg(long, value_parser = choice::<Format>(), default_value = "csv")]
    pub format: Format,
    /// Repeat the run by another method, a thousand times tighter, and print the numerical error
    #[arg(long)]
    pub verify: bool,
}

#[derive(Debug, Args)]
pub struct Compare {
    #[command(flatten)]
    pub source: Source,
    /// A built-in motor's name, or a data sheet's path (.toml) [key: motor; without a scenario: paper-5k5]
    #[arg(long)]
    pub motor: Option<String>,
    /// Only these methods, separated by commas [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = choice::<MethodName>())]
    pub method: Vec<MethodName>,
    /// Sets of errors of drive and sensors, separated by commas [default: the scenario's, or default,harsh]
    #[arg(long, value_delimiter = ',', value_parser = choice::<ErrorSet>())]
    pub errors: Vec<ErrorSet>,
    /// Whether the rotor can move, separated by commas [default: the scenario's, or locked,free]
    #[arg(long, value_delimiter = ',', value_parser = choice::<Rotor>())]
    pub rotor: Vec<Rotor>,
    /// Trials of each method under each set of conditions [default: the scenario's, or 500, of dc-alignment 20]
    #[arg(long, value_parser = whole::<u64>(1..=MOST_ROWS), allow_hyphen_values = true)]
    pub trials: Option<u64>,
    /// Decision rule of methods with a polarity test of their own [key: detector.polarity; default: that of each method]
    #[arg(long, value_parser = choice::<PoleRule>())]
    pub polarity: Option<PoleRule>,
    /// The pole that the methods assume to draw more current [key: detector.signature; default: as the
    /// motor's magnetics say]
    #[arg(long, value_parser = choice::<Signature>())]
    pub signature: Option<Signature>,
    /// Length of the line pulses in µs [key: detector.pulse; default: by the motor's inductances]
    #[arg(long, value_name = "US", value_parser = whole::<u64>(20..=1000), allow_hyphen_values = true)]
    pub pulse: Option<u64>,
    /// Injections and alignment without compensation of the dead time and of the devices' drops [key:
    /// detector.compensation]
    #[arg(long)]
    pub uncompensated: bool,
    #[command(flatten)]
    pub load: Load,
    #[command(flatten)]
    pub temperature: Temperatures,
    #[command(flatten)]
    pub seed: Seed,
    /// Folder for the files, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = OUT)]
    pub out: PathBuf,
    #[command(flatten)]
    pub force: Force,
    /// Leave out the Cramér–Rao limits, which for injections take longer than the trials
    #[arg(long)]
    pub no_limit: bool,
    /// Print a JSON list and write no files
    #[arg(long)]
    pub json: bool,
    /// Number of worker threads [default: one per core]; the results do not depend on it
    #[arg(long, value_parser = whole::<u16>(1..=1024))]
    pub threads: Option<u16>,
}

// `check` chooses the method itself, and refuses `--detector` with advice.
#[derive(Debug, Args)]
#[command(mut_arg("detector", |detector| detector.hide(true)))]
pub struct Check {
    /// A built-in motor's name, a data sheet's path or that of a scenario file (.toml)
    pub motor: String,
    #[command(flatten)]
    pub keys: Keys,
    /// Set of errors of drive and sensors [key: errors; without a scenario: default]
    #[arg(long, value_parser = choice::<ErrorSet>())]
    pub errors: Option<ErrorSet>,
    /// Largest angle error in electrical degrees that the start allows, in 95 of 100 detections
    #[arg(long, value_name = "DEG", default_value_t = 5.0, value_parser = tolerance(), allow_hyphen_values = true)]
    pub tolerance: f64,
    /// Largest movement of a free rotor, in electrical degrees
    #[arg(long, value_name = "DEG", default_value_t = 1.0, value_parser = tolerance(), allow_hyphen_values = true)]
    pub movement: f64,
    /// Largest phase current in A (peak) that the drive may use [default: the motor's rated current]
    #[arg(long, value_name = "A", value_parser = amperes(), allow_hyphen_values = true)]
    pub current: Option<f64>,
    /// Longest time of a detection in ms
    #[arg(long, value_name = "MS", default_value_t = 1000.0, value_parser = milliseconds(), allow_hyphen_values = true)]
    pub time: f64,
    /// quick, normal or high: a quarter of a minute, a minute or a quarter of an hour of processor time at most, about; counted in work,
    /// so that the answer is the same on each machine
    #[arg(long, value_name = "EFFORT", default_value = "normal", value_parser = choice::<Effort>())]
    pub effort: Effort,
    /// Scenario file for the recommended settings [default: check-MOTOR.toml; with --json none]
    #[arg(long, value_name = "FILE.toml")]
    pub write: Option<PathBuf>,
    /// Replace that file if it has other content
    #[arg(long)]
    pub force: bool,
    #[command(flatten)]
    pub seed: Seed,
    #[command(flatten)]
    pub temperature: Temperatures,
    /// Print JSON
    #[arg(long)]
    pub json: bool,
}
