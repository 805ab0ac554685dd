//! Map files of every format, written by `maps/generate.py`.

use std::path::{Path, PathBuf};

use standstill_files::{Files, MapSamples};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/maps")
}

fn error(name: &str) -> String {
    MapSamples::read(&folder().join(name), &Files::default()).expect_err("must be refused").to_string()
}

#[test]
fn cross_every_format_gives_the_points_that_were_written() {
    for name in
        ["axes.npz", "meshes.npz", "dq.npz", "flat_v5.mat", "model_v7.mat", "axes_v7.mat", "model_v73.mat"]
    {
        let samples = MapSamples::read(&folder().join(name), &Files::default())
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(samples.points.len(), 35, "{name}");
        for point in &samples.points {
            let (d, q) = (point.i_d, point.i_q);
            let psi_d = 0.45 + 0.0106 * d - 2e-5 * d * d - 4e-5 * q * q;
            let psi_q = 0.0169 * q - 8e-5 * d * q;
            assert!(
                (point.psi_d - psi_d).abs() < 1e-15 && (point.psi_q - psi_q).abs() < 1e-15,
                "{name}: {point:?}"
            );
        }
        let model = name.starts_with("model");
        assert_eq!(samples.pole_pairs, model.then_some(3), "{name}");
        assert_eq!(samples.resistance, model.then_some(0.55), "{name}");
        let mut at: Vec<_> =
            samples.points.iter().map(|point| (point.i_d.to_bits(), point.i_q.to_bits())).collect();
        at.sort_unstable();
        at.dedup();
        assert_eq!(at.len(), 35, "{name}: each pair of currents once");
    }
}

#[test]
fn regress_what_is_wrong_with_an_array_is_named() {
    for (name, expected) in [
        ("nan.npz", "`psi_d_Wb`, row 3, column 4: found NaN; needed: a finite number"),
        (
            "transposed.npz",
            "i_d along the first index and i_q along the second: here 7 × 5; the fluxes look transposed",
        ),
        ("complex.npz", "`psi_d_Wb`: complex numbers; needed: real floating-point numbers or integers"),
        ("other.mat", "found the variables x; needed: one of these groups: Id, Iq, Fd, Fq; or motorModel"),
        ("part.mat", "found only some of Id, Iq, Fd, Fq; needed: all four"),
        ("generate.py", "found a file ending in `py`; needed: one of csv, txt, tsv, npz, mat"),
        ("missing.csv", "missing.csv: cannot be read: No such file"),
    ] {
        let error = error(name);
        assert!(error.contains(expected) && error.contains(name), "{error}");
    }
}

/// An element of a MATLAB file of version 5.
fn element(kind: u32, data: &[u8]) -> Vec<u8> {
    let mut bytes = [kind.to_le_bytes(), u32::try_from(data.len()).expect("small").to_le_bytes()].concat();
    bytes.extend(data);
    bytes.resize(bytes.len().next_multiple_of(8), 0);
    bytes
}

/// A matrix of such a file.
fn matrix(class: u8, name: &str, [rows, columns]: [usize; 2], values: &[f64]) -> Vec<u8> {
    let size: Vec<u8> =
        [rows, columns].iter().flat_map(|n| u32::try_from(*n).expect("small").to_le_bytes()).collect();
    let parts = [
        element(6, &[class, 0, 0, 0, 0, 0, 0, 0]),
        element(5, &size),
        element(1, name.as_bytes()),
        element(9, &values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>()),
    ];
    element(14, &parts.concat())
}

/// A file of these elements.
fn file(elements: &[Vec<u8>]) -> Vec<u8> {
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M']);
    file.extend(elements.concat());
    file
}

/// A MATLAB file of version 5 of one number.
fn matlab(class: u8, name: &str) -> Vec<u8> {
    file(&[matrix(class, name, [1, 1], &[1.0])])
}

#[test]
fn cross_flux_tables_of_simulink_blocks_have_i_d_along_the_rows() {
    let (d, q) = ([-4.0, -2.0, 0.0, 2.0, 4.0], [-3.0, 0.0, 3.0]);
    // Column after column, as MATLAB keeps them.
    let table = |of: &dyn Fn(f64, f64) -> f64| {
        q.iter().flat_map(|q| d.iter().map(|d| of(*d, *q)).collect::<Vec<_>>()).collect::<Vec<_>>()
    };
    for names in [["iD", "iQ", "fluxD", "fluxQ"], ["id_index", "iq_index", "lambda_d", "lambda_q"]] {
        let bytes = file(&[
            matrix(6, names[3], [5, 3], &table(&|d, q| 0.02 * q - 1e-4 * d * q)),
            matrix(6, names[0], [1, 5], &d),
            matrix(6, names[1], [3, 1], &q),
            matrix(6, names[2], [5, 3], &table(&|d, _| 0.1 + 0.01 * d)),
        ]);
        let scratch = tempfile::tempdir().expect("a folder");
        let path = scratch.path().join("tables.mat");
        std::fs::write(&path, bytes).expect("write");
        let samples = MapSamples::read(&path, &Files::default()).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(samples.points.len(), 15);
        for p in &samples.points {
            let expected = [0.1 + 0.01 * p.i_d, 0.02 * p.i_q - 1e-4 * p.i_d * p.i_q];
            assert_eq!([p.psi_d, p.psi_q], expected, "{p:?}");
        }
    }
}

#[test]
fn regress_what_unpacks_to_more_than_a_map_needs_is_refused_or_left_alone() {
    use std::io::Write as _;
    let packed = |name: &str, megabytes: usize| {
        let inner = matrix(6, name, [1, 1], &[1.0]);
        let mut writer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::fast());
        // The tag says that the matrix is that long.
        let length = u32::try_from((megabytes << 20) + inner.len() - 8).expect("small");
        writer.write_all(&[14_u32.to_le_bytes(), length.to_le_bytes()].concat()).expect("in memory");
        writer.write_all(&inner[8..]).expect("in memory");
        for _ in 0..megabytes {
            writer.write_all(&vec![0; 1 << 20]).expect("in memory");
        }
        let data = writer.finish().expect("in memory");
        // Compressed elements are not padded.
        let mut bytes =
            [15_u32.to_le_bytes(), u32::try_from(data.len()).expect("small").to_le_bytes()].concat();
        bytes.extend(data);
        bytes
    };
    let scratch = tempfile::tempdir().expect("a folder");
    let error = |name: &str, elements: &[Vec<u8>]| {
        let path = scratch.path().join(name);
        std::fs::write(&path, file(elements)).expect("write");
        MapSamples::read(&path, &Files::default()).expect_err("must be refused").to_string()
    };
    // Together too much, of what is used.
    let bombs = [packed("Id", 150), packed("Iq", 150)];
    let message = error("bomb.mat", &bombs);
    assert!(message.contains("more than 256 MiB"), "{message}");
    // What is not used is not unpacked, and how much it is does not matter.
    let other: Vec<Vec<u8>> = (0..6).map(|k| packed(&format!("x{k}"), 150)).collect();
    let begin = std::time::Instant::now();
    let message = error("other.mat", &other);
    assert!(message.contains("found the variables x0, x1, x2"), "{message}");
    assert!(begin.elapsed().as_secs() < 5, "{:?}", begin.elapsed());
}

#[test]
fn law_many_small_parts_of_a_file_do_not_make_much_work() {
    use std::io::Write as _;
    let scratch = tempfile::tempdir().expect("a folder");
    let error = |name: &str, bytes: &[u8]| {
        let path = scratch.path().join(name);
        std::fs::write(&path, bytes).expect("write");
        MapSamples::read(&path, &Files::default()).expect_err("must be refused").to_string()
    };
    // Packed variables of one number.
    let mut writer = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    writer.write_all(&matrix(6, "x", [1, 1], &[1.0])).expect("in memory");
    let data = writer.finish().expect("in memory");
    let mut packed = [15_u32.to_le_bytes(), u32::try_from(data.len()).expect("small").to_le_bytes()].concat();
    packed.extend(data);
    let message = error("packed.mat", &file(&vec![packed; 50_000]));
    assert!(message.contains("more than 4096 packed variables"), "{message}");
    // A name of megabytes, none of which is UTF-8, and as many dimensions.
    let parts = [
        element(6, &[6, 0, 0, 0, 0, 0, 0, 0]),
        element(5, &vec![1; 4 << 20]),
        element(1, &vec![0xff; 8 << 20]),
        element(9, &[0; 8]),
    ];
    let message = error("name.mat", &file(&[element(14, &parts.concat())]));
    assert!(message.contains("found the variables \u{fffd}") && message.len() < 2000, "{}", message.len());
}

#[test]
fn regress_files_of_other_kinds_are_told_by_their_kind() {
    let scratch = tempfile::tempdir().expect("a folder");
    // Type, rows, columns, whether complex; then the name.
    let version_4 = |words: [u32; 4], big: bool| {
        let order = |word: u32| if big { word.to_be_bytes() } else { word.to_le_bytes() };
        let mut bytes: Vec<u8> = words.into_iter().chain([3]).flat_map(order).collect();
        bytes.extend(b"Id\0");
        bytes.extend(1.0_f64.to_le_bytes());
        bytes
    };
    let four = "found a MATLAB file of version 4; needed: a MATLAB file of version 5 to 7.3";
    let cases: [(&str, Vec<u8>, &str); 13] = [
        ("empty.mat", Vec::new(), "found an empty file; needed: a flux map as `mat` file"),
        ("empty.npz", Vec::new(), "found an empty file"),
        ("empty.csv", Vec::new(), "found an empty file; needed: a header with the columns"),
        ("four.mat", version_4([0, 1, 1, 0], false), four),
        ("four_big.mat", version_4([1000, 1, 1, 0], true), four),
        ("four_complex.mat", version_4([0, 1, 1, 1], false), four),
        ("four_text.mat", version_4([51, 1, 1, 0], false), four),
        ("four_sparse.mat", version_4([2, 3, 3, 0], false), four),
        // More numbers than there can be.
        ("four_false.mat", version_4([0, u32::MAX, u32::MAX, 0], false), "found no MATLAB header"),
        ("text.mat", b"i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n".repeat(9), "found no MATLAB header"),
        (
            "sparse.mat",
            matlab(5, "Id"),
            "`Id`: a sparse matrix, which `full` makes one; needed: a full matrix",
        ),
        ("cell.mat", matlab(1, "Id"), "`Id`: a cell array; needed: a full matrix of real numbers"),
        ("names.mat", matlab(6, "i_d_A"), "found the variables i_d_A; needed: one of these groups"),
    ];
    for (name, bytes, expected) in cases {
        let path = scratch.path().join(name);
        std::fs::write(&path, bytes).expect("write");
        let error = MapSamples::read(&path, &Files::default()).expect_err("must be refused").to_string();
        assert!(error.contains(expected) && error.contains(name), "{error}");
    }
}

#[test]
fn regress_broken_files_are_refused_and_never_panic() {
    broken(60, false);
}

#[test]
#[ignore = "more bytes, each changed in three ways: scripts/test-all.sh long"]
fn regress_files_broken_at_more_bytes_never_panic() {
    broken(400, true);
}

/// Files that end early, and files with so many changed bytes, each in one way of three or in all.
fn broken(places: usize, each_way: bool) {
    let scratch = tempfile::tempdir().expect("a folder");
    for name in ["axes.npz", "meshes.npz", "flat_v5.mat", "model_v7.mat", "model_v73.mat"] {
        let whole = std::fs::read(folder().join(name)).expect("fixture");
        let path = scratch.path().join(name);
        let mut refused = 0;
        for cut in (0..whole.len()).step_by(whole.len() / 60 + 1) {
            std::fs::write(&path, &whole[..cut]).expect("write");
            refused += u32::from(MapSamples::read(&path, &Files::default()).is_err());
        }
        // The end of an HDF5 file may be room that nothing uses.
        assert!(refused >= 40, "{name}: {refused}");
        // A changed byte may do no harm, but must not do any either.
        for (number, at) in (0..whole.len()).step_by(whole.len() / places + 1).enumerate() {
            let ways = [0x01, 0x80, 0xff];
            for flip in if each_way { &ways[..] } else { &ways[number % 3..][..1] } {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                std::fs::write(&path, &bytes).expect("write");
                let _ = MapSamples::read(&path, &Files::default());
            }
        }
    }
}
