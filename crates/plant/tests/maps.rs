//! Map files of every format, written by `maps/generate.py`.

use std::path::{Path, PathBuf};

use standstill_plant::{Files, FluxMap, MapSamples};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/maps")
}

fn error(name: &str) -> String {
    MapSamples::read(&folder().join(name), &Files::default()).expect_err("must be refused").to_string()
}

#[test]
fn cross_every_format_gives_the_points_that_were_written() {
    for name in ["axes.npz", "meshes.npz", "flat_v5.mat", "model_v7.mat", "axes_v7.mat", "model_v73.mat"] {
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
        FluxMap::new(&samples).unwrap_or_else(|error| panic!("{error}"));
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
        ("complex.npz", "`psi_d_Wb`: numbers of type `<c16`"),
        ("other.mat", "found the variables x; needed: Id, Iq, Fd, Fq"),
        ("part.mat", "found only some of Id, Iq, Fd, Fq; needed: all four"),
        ("generate.py", "found a file ending in `py`; needed: one of csv, npz, mat"),
        ("missing.csv", "missing.csv: cannot be read: No such file"),
    ] {
        let error = error(name);
        assert!(error.contains(expected) && error.contains(name), "{error}");
    }
}

/// A MATLAB file of version 5 of one matrix.
fn matlab(class: u8, name: &str) -> Vec<u8> {
    let element = |kind: u32, data: &[u8]| {
        let mut bytes =
            [kind.to_le_bytes(), u32::try_from(data.len()).expect("small").to_le_bytes()].concat();
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(8), 0);
        bytes
    };
    let parts = [
        element(6, &[class, 0, 0, 0, 0, 0, 0, 0]),
        element(5, &[1, 0, 0, 0, 1, 0, 0, 0]),
        element(1, name.as_bytes()),
        element(9, &1.0_f64.to_le_bytes()),
    ];
    let mut file = vec![b' '; 124];
    file.extend([0, 1, b'I', b'M']);
    file.extend(element(14, &parts.concat()));
    file
}

#[test]
fn regress_files_of_other_kinds_are_told_by_their_kind() {
    let scratch = tempfile::tempdir().expect("a folder");
    let mut version_4: Vec<u8> = [0_u32, 1, 1, 0, 3].iter().flat_map(|word| word.to_le_bytes()).collect();
    version_4.extend(b"Id\0");
    version_4.extend(1.0_f64.to_le_bytes());
    let cases: [(&str, Vec<u8>, &str); 8] = [
        ("empty.mat", Vec::new(), "found an empty file; needed: a flux map as `mat` file"),
        ("empty.npz", Vec::new(), "found an empty file"),
        ("empty.csv", Vec::new(), "found an empty file; needed: a header with the columns"),
        (
            "four.mat",
            version_4,
            "found a MATLAB file of version 4; needed: a MATLAB file of version 5 to 7.3",
        ),
        ("text.mat", b"i_d_A,i_q_A,psi_d_Wb,psi_q_Wb\n".repeat(9), "found no MATLAB header"),
        (
            "sparse.mat",
            matlab(5, "Id"),
            "`Id`: a sparse matrix, which `full` makes one; needed: a full matrix",
        ),
        ("cell.mat", matlab(1, "Id"), "`Id`: a cell array; needed: a full matrix of real numbers"),
        ("names.mat", matlab(6, "i_d_A"), "i_d_A, i_q_A, psi_d_Wb, psi_q_Wb are for .csv and .npz files"),
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
        for at in (0..whole.len()).step_by(whole.len() / 400 + 1) {
            for flip in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                std::fs::write(&path, &bytes).expect("write");
                let _ = MapSamples::read(&path, &Files::default());
            }
        }
    }
}
