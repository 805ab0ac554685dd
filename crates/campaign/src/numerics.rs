//! The number of the numerics.

pub mod digests;

/// Version of the program's numerical results. It is part of a run's identity, so that no run continues with other
/// numbers than it began with. It is the number of lines in `numerics.txt`, each with digests of results that cover all
/// methods and motors; `tests/numerics.rs` fails with the line to append if any bit of them changes.
pub const NUMERICS: u32 = lines(digests::TEXT.as_bytes());

const fn lines(text: &[u8]) -> u32 {
    let (mut k, mut lines) = (0, 0);
    while k < text.len() {
        if text[k] == b'\n' {
            lines += 1;
        }
        k += 1;
    }
    lines
}
