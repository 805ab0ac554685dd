use super::super::journal::{Journal, Keep as _};
use super::super::walk::tests::row;
use super::*;
use standstill_scenario::StopTable;

fn identity(index: u64, count: u64, seed: u64) -> Identity {
    Identity {
        version: "1".to_owned(),
        numerics: NUMERICS,
        seed,
        points: 3,
        trials: 10,
        stop_at: StopTable::default(),
        shard: Shard { index, count },
        scenario: format!("seed = {seed}\n"),
        pole_note: None,
        pole_is_open: false,
        map_note: None,
        motor_note: None,
        library_note: None,
        files: BTreeMap::new(),
    }
}

/// Writes the journal of a shard, without its last `short` rows.
fn write(folder: &Path, identity: &Identity, short: usize) -> PathBuf {
    std::fs::create_dir_all(folder).expect("made");
    let path = folder.join(identity.shard.file_name());
    let mut journal = Journal::create(&path, identity).expect("writable");
    let ahead = journal.walk().ahead(u64::MAX);
    let rows: Vec<Row> = ahead.iter().take(ahead.len() - short).map(|(_, trial)| row(*trial, 1.0)).collect();
    journal.append(&rows).expect("written");
    folder.to_owned()
}

/// promise: shards-are-the-run
#[test]
fn law_shards_are_the_run_and_what_is_not_is_refused_by_name() {
    let root = tempfile::tempdir().expect("a folder");
    let at = |name: &str| root.path().join(name);
    let parts: Vec<PathBuf> =
        [2, 4, 1, 3].map(|k| write(&at(&format!("part{k}")), &identity(k, 4, 1), 0)).into();
    let shards = Shards::collect(&parts).expect("complete");
    assert_eq!(shards.identity, identity(1, 1, 1));
    let mut places = Vec::new();
    shards
        .rows(|point, row| {
            places.push((point, row.trial));
            Ok::<(), JournalError>(())
        })
        .expect("readable");
    let expected: Vec<_> = (0..3).flat_map(|point| (0..10).map(move |trial| (point, trial))).collect();
    assert_eq!(places, expected);
    // Of a program that computes otherwise.
    let other = Identity { numerics: NUMERICS + 1, ..identity(1, 1, 1) };
    let message = Shards::collect(&[write(&at("other"), &other, 0)]).expect_err("refused").to_string();
    assert!(message.contains("other") && message.contains(&format!("is {}", NUMERICS + 1)), "{message}");
    // The same folder twice is no overlap.
    Shards::collect(&[parts.clone(), parts.clone()].concat()).expect("complete");

    let refused = |folders: &[PathBuf]| Shards::collect(folders).expect_err("refused").to_string();
    let message = refused(&parts[..2]);
    assert!(
        message.starts_with("missing: shard 1/4, shard 3/4: ") && message.ends_with("--shard 1/4"),
        "{message}"
    );
    let copy = write(&at("copy"), &identity(2, 4, 1), 0);
    let message = refused(&[parts.clone(), vec![copy]].concat());
    assert!(message.starts_with("shard 2/4 is there twice: ") && message.contains("copy"), "{message}");
    let foreign = write(&at("foreign"), &identity(3, 4, 2), 0);
    let message = refused(&[parts[..3].to_vec(), vec![foreign]].concat());
    assert!(message.contains("foreign") && message.contains("the seed is 2 there and 1 here"), "{message}");
    let other = write(&at("thirds"), &identity(3, 3, 1), 0);
    let message = refused(&[parts[..3].to_vec(), vec![other]].concat());
    assert!(message.contains("is shard 2/4 and ") && message.contains("thirds"), "{message}");
    assert!(message.contains("shard 3/3: shards of two splits overlap"), "{message}");
    // Nor may one be begun there, whatever is to be replaced; of another run only if that is.
    for leave in [false, true] {
        let message = beside(&parts[0], &identity(3, 3, 1), leave).expect_err("refused").to_string();
        assert!(message.contains("shard 3/3") && message.contains("/4 and "), "{message}");
    }
    let message = beside(&parts[0], &identity(4, 4, 2), false).expect_err("refused").to_string();
    assert!(message.contains("the seed is 1 there and 2 here"), "{message}");
    beside(&parts[0], &identity(4, 4, 2), true).expect("with leave");
    beside(&parts[0], &identity(4, 4, 1), false).expect("of the same run");
    let short = write(&at("short"), &identity(3, 4, 1), 2);
    let message = refused(&[parts[..3].to_vec(), vec![short]].concat());
    assert!(message.contains("shard 3/4 is not finished") && message.contains("up to 2 trials"), "{message}");
    std::fs::create_dir(at("empty")).expect("made");
    assert!(refused(&[at("empty")]).contains("has no journal"));
    assert!(refused(&[at("nowhere")]).contains("nowhere"));
}
