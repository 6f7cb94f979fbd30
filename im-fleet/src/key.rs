//! What a job is known by: a hash of everything that its row depends on.

use std::fs::File;
use std::io;
use std::path::Path;

use im_diagnose::intake;
use sha2::{Digest, Sha256};

use crate::job::Job;
use crate::settings::Settings;

/// The program whose rows these are: another version may judge otherwise.
const VERSION: &str = concat!("im-fleet ", env!("CARGO_PKG_VERSION"), " table 1");

/// Sixteen bytes of the SHA-256 of the version, the settings, the names in the row and the bytes of every file, in hexadecimal. What cannot be read
/// counts as what the system says of it.
pub fn key(job: &Job, settings: &Settings) -> String {
    let mut hash = Sha256::new();
    let mut text = |what: &str| {
        hash.update((what.len() as u64).to_le_bytes());
        hash.update(what);
    };
    for part in [VERSION, &job.unit, &job.kind, &job.date, &settings.text()] {
        text(part);
    }
    file(&mut hash, &job.motor);
    for (role, path) in job.train.iter().map(|p| ("train", p)).chain(job.holdout.iter().map(|p| ("holdout", p))) {
        hash.update(role);
        // A recording and the mapping beside it; where that cannot be read, the recording alone.
        let files = intake::files(path, job.mapping.as_deref()).unwrap_or_else(|_| vec![path.clone()]);
        files.iter().for_each(|p| file(&mut hash, p));
    }
    hexadecimal(&hash.finalize()[..16])
}

/// SHA-256 of the bytes of a file, as `sha256sum` prints it.
///
/// # Errors
/// It cannot be read.
pub fn sha256(path: &Path) -> io::Result<String> {
    let mut hash = Sha256::new();
    io::copy(&mut File::open(path)?, &mut hash)?;
    Ok(hexadecimal(&hash.finalize()))
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

/// A number by which shards take their jobs: adding a motor moves no other to another shard.
pub fn number(key: &str) -> u64 {
    u64::from_str_radix(&key[..12.min(key.len())], 16).unwrap_or(0)
}

fn file(hash: &mut Sha256, path: &Path) {
    hash.update(path.file_name().unwrap_or_default().as_encoded_bytes());
    hash.update(sha256(path).unwrap_or_else(|e| e.kind().to_string()));
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::Shard;

    /// The example of FIPS 180-2, B.1.
    #[test]
    fn a_file_has_the_sha256_of_its_bytes() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(&file, "abc").unwrap();
        let printed = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(file.path()).unwrap(), printed);
        assert!(sha256(Path::new("not/there")).is_err());
    }

    #[test]
    fn shards_take_every_key_once_and_about_as_many() {
        let keys: Vec<String> =
            (0..500u64).map(|k| format!("{:032x}", u128::from(k.wrapping_mul(0x9e37_79b9_7f4a_7c15)) << 64)).collect();
        let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].map(|s| s.parse().unwrap()).to_vec();
        for key in &keys {
            assert_eq!(shards.iter().filter(|s| s.has(number(key))).count(), 1, "{key}");
        }
        assert!(shards.iter().all(|s| keys.iter().filter(|k| s.has(number(k))).count() > 120));
    }
}
