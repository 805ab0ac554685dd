//! What the program computes, to the last bit, and the number under which it is known.
//!
//! A change of any result fails here until the number is raised. Then
//! `NUMERICS=raise cargo test -p standstill-campaign --test numerics` appends the line that belongs in
//! `src/numerics.txt`.

use std::io::Write as _;
use std::sync::atomic::AtomicBool;

use standstill_campaign::{NUMERICS, digests};

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/src/numerics.txt");

/// promise: results-change-with-their-number
#[test]
fn golden_effects_keep_their_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    let stop = AtomicBool::new(false);
    let found = digests::effects(folder.path(), &stop).expect("runs");
    let kept: Vec<_> = found.iter().map(|of| (&of.name, &of.kept)).collect();
    let here: Vec<_> = found.iter().map(|of| (&of.name, &of.here)).collect();
    assert_eq!(kept, here);
    // Without its table each of them gives other rows.
    let plain = "[axes]\n\"rotor.state\" = [\"locked\", \"free\"]";
    let plain = digests::of_scenario(folder.path(), "plain", plain, &stop).expect("runs");
    assert!(found.iter().all(|of| of.here != plain));
}

/// promise: results-change-with-their-number
#[test]
fn golden_results_change_only_with_the_number_of_the_numerics() {
    let text = std::fs::read_to_string(FILE).expect("readable");
    let lines: Vec<(u32, Vec<&str>)> = text
        .lines()
        .map(|line| {
            let (number, digests) = line.split_once(' ').expect("a number and digests");
            (number.parse().expect("a number"), digests.split(' ').collect())
        })
        .collect();
    for (k, (number, digests)) in lines.iter().enumerate() {
        assert_eq!(usize::try_from(*number), Ok(k + 1), "each number is the next one: only append lines");
        assert!(lines[..k].iter().all(|(_, others)| others != digests), "{number} is an earlier line again");
    }
    let folder = tempfile::tempdir().expect("a folder");
    let found = digests::methods(folder.path(), &AtomicBool::new(false)).expect("runs");
    let known = lines.last().map_or(&[][..], |(_, digests)| digests);
    let changed: Vec<&str> =
        found.iter().filter(|of| of.kept != of.here).map(|of| of.name.as_str()).collect();
    if changed.is_empty() && known.len() == found.len() {
        assert_eq!(usize::try_from(NUMERICS), Ok(lines.len()));
        return;
    }
    let all: Vec<&str> = found.iter().map(|of| of.here.as_str()).collect();
    let line = format!("{} {}", lines.len() + 1, all.join(" "));
    if std::env::var("NUMERICS").is_ok_and(|word| word == "raise") {
        let mut file = std::fs::OpenOptions::new().append(true).open(FILE).expect("writable");
        writeln!(file, "{line}").expect("written");
        println!("appended to {FILE}: {line}");
        return;
    }
    panic!(
        "the results of {} are no longer those of numerics {}. If that is meant, append this line to {FILE}, so that no \
         interrupted run goes on with other numbers (NUMERICS=raise does it):\n{line}",
        changed.join(", "),
        lines.len(),
    );
}
