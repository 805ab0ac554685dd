//! Tables of TOML: as typed values, and where in a text their keys stand.

mod keyed;
pub(crate) mod lacking;
mod place;
mod wording;

pub(crate) use keyed::Keyed;
pub use keyed::{TableError, in_words, read_keyed};
pub use place::{key_span, line_of, quoted, syntax};
