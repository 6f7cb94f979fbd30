//! Damaged files end in a message: never a panic, never more memory than their size explains.

use std::path::PathBuf;

use im_formats::{FormatError, read};

const FILES: [&str; 12] = [
    "v6.mat",
    "v7.mat",
    "v73.mat",
    "plain.h5",
    "plain.mf4",
    "packed.mf4",
    "turned.mf4",
    "two_groups.tdms",
    "interleaved.tdms",
    "ascii.cfg",
    "binary.cfg",
    "binary.dat",
];

fn data(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Numbers without a pattern (Marsaglia, xorshift64).
struct Random(u64);

impl Random {
    fn next(&mut self, below: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % below as u64) as usize
    }
}

/// Some bytes changed, lengths made huge, a piece cut out or put in twice, the end lost.
fn damaged(whole: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    for _ in 0..=random.next(4) {
        let at = random.next(bytes.len());
        match random.next(6) {
            0 => bytes[at] = random.next(256) as u8,
            1 => bytes[at] ^= 1 << random.next(8),
            2 => bytes.iter_mut().skip(at).take(8).for_each(|b| *b = 0xff),
            3 => bytes.truncate(at.max(1)),
            4 => {
                let end = (at + random.next(64)).min(bytes.len() - 1);
                bytes.drain(at.min(end)..end);
            }
            _ => {
                let piece: Vec<u8> = bytes[at..].iter().copied().take(64).collect();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

#[test]
fn two_thousand_damaged_files_give_a_table_or_a_message() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut refused = 0;
    for k in 0..2000 {
        let name = FILES[k % FILES.len()];
        let path = folder.path().join(name);
        std::fs::write(&path, damaged(&std::fs::read(data(name)).unwrap(), &mut random)).unwrap();
        let stem = data(name);
        let other = if name.ends_with("cfg") { "dat" } else { "cfg" };
        if matches!(stem.extension().and_then(|e| e.to_str()), Some("cfg" | "dat")) {
            std::fs::copy(stem.with_extension(other), path.with_extension(other)).unwrap();
        }
        match read(&path) {
            Ok(table) => {
                assert!(table.rows() >= 2 && table.columns.iter().all(|c| c.len() == table.rows()), "{name}, damage {k}");
                assert!(table.names.len() == table.columns.len(), "{name}, damage {k}");
            }
            Err(error) => {
                refused += 1;
                assert!(error.to_string().len() > 20, "{name}, damage {k}: {error}");
            }
        }
    }
    assert!(refused > 1000, "only {refused} of 2000 were refused");
}

#[test]
fn what_ends_too_early_says_so() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["v6.mat", "v7.mat", "plain.mf4", "packed.mf4", "two_groups.tdms"] {
        let whole = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, &whole[..whole.len() * 2 / 3]).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, FormatError::Truncated { .. }), "{name}: {error}");
    }
    let path = folder.path().join("binary.cfg");
    std::fs::copy(data("binary.cfg"), &path).unwrap();
    std::fs::write(path.with_extension("dat"), &std::fs::read(data("binary.dat")).unwrap()[..1001]).unwrap();
    assert!(read(&path).unwrap_err().to_string().contains("is not rows of 14"));
    std::fs::remove_file(path.with_extension("dat")).unwrap();
    assert!(read(&path).unwrap_err().to_string().contains("no .dat of the same name"));
}

#[test]
fn empty_and_foreign_files_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in [("empty.mat", &b""[..]), ("text.tdms", b"t,u\n0,1\n"), ("short.mf4", b"MDF     4.10    ")] {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        assert!(read(&path).is_err(), "{name}");
    }
    let path = folder.path().join("old.mf4");
    std::fs::write(&path, b"MDF     3.30    ").unwrap();
    let error = read(&path).unwrap_err().to_string();
    assert!(error.contains("of version 3.30") && error.contains("convert('4.10')"), "{error}");
    assert!(read(&folder.path().join("none.tdms")).unwrap_err().to_string().contains("No such file"));
}
