//! Blocks of a journal: their length, their bytes, their checksum.

use std::collections::BTreeMap;
use std::io::{self, Read};

use serde::Serialize;
use serde::de::DeserializeOwned;

/// Most bytes of a block. Those that a run writes have a thousandth of it; a damaged length may claim 4 GiB, which a sparse file has.
const MOST_BLOCK: u32 = 64 << 20;

/// Returns a block of these bytes.
pub(super) fn block(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let length = u32::try_from(bytes.len()).ok().filter(|length| *length <= MOST_BLOCK);
    let length = length.ok_or(io::ErrorKind::FileTooLarge)?;
    Ok([&length.to_le_bytes(), bytes, &crc32fast::hash(bytes).to_le_bytes()].concat())
}

/// Values that follow the first one in a block, each under the number of its row or point. Earlier builds wrote none, and read the first
/// value alone.
pub(super) type Tail<T> = BTreeMap<usize, T>;

/// Encodes a value and its tail as one block.
pub(super) fn encoded<T: Serialize>(
    value: &(impl Serialize + ?Sized),
    tail: &Tail<T>,
) -> io::Result<Vec<u8>> {
    let mut bytes = postcard::to_stdvec(value).map_err(io::Error::other)?;
    if !tail.is_empty() {
        bytes.extend(postcard::to_stdvec(tail).map_err(io::Error::other)?);
    }
    block(&bytes)
}

/// Returns the value of a block, and the data behind it.
pub(super) fn split<T: DeserializeOwned, B: DeserializeOwned>(
    bytes: &[u8],
) -> postcard::Result<(T, Tail<B>)> {
    let (value, behind) = postcard::take_from_bytes(bytes)?;
    let tail = if behind.is_empty() { Tail::new() } else { postcard::from_bytes(behind)? };
    Ok((value, tail))
}

/// Result of reading a block.
pub(super) enum Block {
    /// The bytes of a block.
    Whole(Vec<u8>),
    /// The end of the file, in a block or behind the last.
    Short,
    /// Another checksum, or longer than any block.
    Wrong,
}

/// Returns the next block; `whole` moves behind it.
pub(super) fn read_block(file: &mut impl Read, whole: &mut u64) -> io::Result<Block> {
    let mut word = [0; 4];
    if !read_word(file, &mut word)? {
        return Ok(Block::Short);
    }
    let length = u32::from_le_bytes(word);
    if length > MOST_BLOCK {
        return Ok(Block::Wrong);
    }
    let mut bytes = Vec::new();
    // Nor must a damaged length ask for megabytes that are not there.
    file.take(u64::from(length)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 != u64::from(length) || !read_word(file, &mut word)? {
        return Ok(Block::Short);
    }
    // After a power cut a file may end in zeros, which would pass for a block of nothing with its checksum.
    if length == 0 || u32::from_le_bytes(word) != crc32fast::hash(&bytes) {
        return Ok(Block::Wrong);
    }
    *whole += 8 + u64::from(length);
    Ok(Block::Whole(bytes))
}

/// Returns whether four more bytes were read. Only a real end of the file counts as its end; a read error is returned
/// as an error.
fn read_word(file: &mut impl Read, word: &mut [u8; 4]) -> io::Result<bool> {
    match file.read_exact(word) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_what_is_behind_a_value_is_left_out_by_those_who_do_not_know_it() {
        let value = vec![(1_u64, "one".to_owned()), (2, "two".to_owned())];
        let bytes = |block: Vec<u8>| block[4..block.len() - 4].to_vec();
        let before = bytes(encoded(&value, &Tail::<f64>::new()).expect("encoded"));
        assert_eq!(before, postcard::to_stdvec(&value).expect("encoded"));
        let tail = Tail::from([(1, 30.0)]);
        let now = bytes(encoded(&value, &tail).expect("encoded"));
        // A program of before reads the value of now, and one of now that of before.
        assert_eq!(postcard::from_bytes::<Vec<(u64, String)>>(&now), Ok(value.clone()));
        assert_eq!(split(&now), Ok((value.clone(), tail)));
        assert_eq!(split(&before), Ok((value, Tail::<f64>::new())));
    }
}
