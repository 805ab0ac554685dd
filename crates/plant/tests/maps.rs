//! Map files of every format, written by `maps/generate.py`.

use std::path::{Path, PathBuf};

use standstill_plant::{FluxMap, MapSamples};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/maps")
}

fn error(name: &str) -> String {
    MapSamples::read(&folder().join(name)).expect_err("must be refused").to_string()
}

#[test]
fn cross_every_format_gives_the_points_that_were_written() {
    for name in ["axes.npz", "meshes.npz", "flat_v5.mat", "model_v7.mat", "axes_v7.mat", "model_v73.mat"] {
        let samples = MapSamples::read(&folder().join(name)).unwrap_or_else(|error| panic!("{error}"));
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
        ("transposed.npz", "i_d along the first index and i_q along the second: here 7 × 5"),
        ("complex.npz", "`psi_d_Wb`: numbers of type `<c16`"),
        ("other.mat", "found the variables x; needed: Id, Iq, Fd, Fq"),
        ("part.mat", "found only some of Id, Iq, Fd, Fq; needed: all four"),
        ("generate.py", "found a file ending in `py`; needed: one of csv, npz, mat"),
        ("missing.csv", "missing.csv: found No such file"),
    ] {
        let error = error(name);
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
            refused += u32::from(MapSamples::read(&path).is_err());
        }
        // The end of an HDF5 file may be room that nothing uses.
        assert!(refused >= 40, "{name}: {refused}");
        // A changed byte may do no harm, but must not do any either.
        for at in (0..whole.len()).step_by(whole.len() / 400 + 1) {
            for flip in [0x01, 0x80, 0xff] {
                let mut bytes = whole.clone();
                bytes[at] ^= flip;
                std::fs::write(&path, &bytes).expect("write");
                let _ = MapSamples::read(&path);
            }
        }
    }
}
