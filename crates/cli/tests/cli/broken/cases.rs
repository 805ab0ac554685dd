//! The commands that write files.

/// A command that writes into the folder `o`.
pub struct Case {
    pub name: &'static str,
    pub words: &'static [&'static str],
    /// Words that make another question of it, or the whole other command; none if nothing of it is ever replaced.
    pub other: Option<&'static [&'static str]>,
    /// Whether `--resume` goes on.
    pub resumes: bool,
    /// Whether it takes a fraction of a second, unoptimised.
    pub quick: bool,
}

impl Case {
    /// Whether it writes a single file, into a folder that must be there.
    pub fn is_single(&self) -> bool {
        self.words.iter().any(|word| word.starts_with("o/"))
    }

    /// Whether a second time is refused, because the file is there.
    pub fn is_once(&self) -> bool {
        self.name == "init"
    }
}

const fn case(
    name: &'static str,
    words: &'static [&'static str],
    other: &'static [&'static str],
    resumes: bool,
) -> Case {
    Case { name, words, other: Some(other), resumes, quick: false }
}

const fn quick(
    name: &'static str,
    words: &'static [&'static str],
    other: &'static [&'static str],
    resumes: bool,
) -> Case {
    Case { quick: true, ..case(name, words, other, resumes) }
}

const SEED: &[&str] = &["--seed", "2"];

/// Every command that writes files.
pub const CASES: &[Case] = &[
    quick("run", &["run", "s.toml", "--out", "o"], SEED, true),
    case("parquet", &["run", "s.toml", "--format", "parquet", "--out", "o"], SEED, true),
    quick("statistics", &["run", "s.toml", "--rows", "none", "--out", "o"], SEED, true),
    quick("shard", &["run", "s.toml", "--shard", "1/2", "--out", "o"], SEED, true),
    quick("sweep", &["sweep", "s.toml", "--vary", "errors=default,harsh", "--out", "o"], SEED, true),
    quick("merge", &["merge", "shards", "--out", "o"], &["merge", "shards-2", "--out", "o"], false),
    quick("report", &["report", "done", "--out", "o"], &["report", "done-2", "--out", "o"], false),
    case(
        "report of two",
        &["report", "done", "done-2", "--out", "o"],
        &["report", "done-2", "done", "--out", "o"],
        false,
    ),
    quick("reproduce", &["reproduce", "--trials", "20", "--out", "o"], SEED, false),
    case(
        "compare",
        &[
            "compare", "s.toml", "--method", "bipolar", "--rotor", "locked", "--errors", "default",
            "--trials", "5", "--out", "o",
        ],
        SEED,
        false,
    ),
    case(
        "odds",
        &["odds", "l.toml", "--event", "|e| > 1 deg", "--effort", "quick", "--out", "o"],
        SEED,
        true,
    ),
    case("budget", &["budget", "s.toml", "--pairs", "100", "--out", "o"], SEED, true),
    case(
        "require",
        &[
            "require",
            "s.toml",
            "--key",
            "sensors.noise",
            "--between",
            "5 mA:50 mA",
            "--limit",
            "rms <= 1 deg",
            "--most",
            "100",
            "--out",
            "o",
        ],
        SEED,
        true,
    ),
    case(
        "tune",
        &[
            "tune",
            "l.toml",
            "--vary",
            "detector.pulse=60us:120us",
            "--trials",
            "1000",
            "--starts",
            "1",
            "--minimise",
            "rms",
            "--out",
            "o",
        ],
        SEED,
        true,
    ),
    quick(
        "faults",
        &["faults", "s.toml", "--trials", "20", "--mode", "phase-open", "--out", "o"],
        SEED,
        true,
    ),
    quick("qualify", &["qualify", "s.toml", "r.toml", "--no-witness", "--out", "o"], SEED, true),
    case(
        "explain",
        &["explain", "done", "--trial", "1", "--out", "o"],
        &["explain", "done-2", "--trial", "1", "--out", "o"],
        false,
    ),
    case("trace", &["trace", "s.toml", "--angle", "20", "--out", "o"], &["-s", "errors=none"], false),
    quick(
        "magnetics",
        &["magnetics", "paper-5k5", "--out", "o"],
        &["magnetics", "outrunner", "--out", "o"],
        false,
    ),
    case(
        "fit",
        &["fit", "t.csv", "--motor", "paper-5k5", "--out", "o"],
        &["fit", "t.csv", "--motor", "gearless-hoist", "--out", "o"],
        false,
    ),
    case(
        "check",
        &["check", "s.toml", "--effort", "quick", "--write", "o/c.toml"],
        &["check", "l.toml", "--effort", "quick", "--write", "o/c.toml"],
        false,
    ),
    Case { other: None, ..quick("init", &["init", "o/s.toml"], &[], false) },
    case("fmu", &["fmu", "paper-5k5", "--out", "o/d.fmu"], &["-s", "sensors.noise=1 mA"], false),
    Case { other: None, ..quick("man", &["man", "--out", "o"], &[], false) },
];
