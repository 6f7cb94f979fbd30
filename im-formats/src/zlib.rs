//! Packed parts of files, unpacked within a bound.

use std::io::Read;

use crate::{Format, FormatError};

/// What a packed part may grow to. Deflate packs at most 1:1032, so that a small file cannot reach it by mistake.
const LIMIT: usize = 1 << 31;

pub(crate) fn unpack(packed: &[u8], format: Format) -> Result<Vec<u8>, FormatError> {
    let mut bytes = Vec::new();
    let mut decoder = flate2::read::ZlibDecoder::new(packed).take(LIMIT as u64);
    decoder
        .read_to_end(&mut bytes)
        .map_err(|e| FormatError::Invalid { format, reason: format!("a packed part cannot be unpacked ({e})") })?;
    if bytes.len() == LIMIT {
        let found = "with a packed part of over 2 GiB".to_owned();
        return Err(FormatError::Unsupported { format, found, remedy: "save the recording in parts" });
    }
    Ok(bytes)
}
