//! Recordings as other programs write them, as one table of numbers.
//!
//! | file | written by | module |
//! |---|---|---|
//! | MAT 5 (`save -v6`, `-v7`) | MATLAB, Simulink, SciPy, Octave | `mat5` |
//! | MAT 7.3 and HDF5 (feature `hdf5`) | MATLAB `save -v7.3`, h5py | `hdf5` |
//! | MDF 4 | CANape, INCA, asammdf | `mdf` |
//! | TDMS | LabVIEW, DIAdem, npTDMS | `tdms` |
//! | COMTRADE | fault recorders, relays, power analysers | `comtrade` |
//!
//! Channels of other rates are brought to the time axis of the fastest by straight lines between their samples, over the time that all
//! cover (`align`). What is read is numbers; texts, scalars and objects are left out and listed. No length in a file is believed before
//! it has been compared with what is there.
//!
//! ```no_run
//! let table = im_formats::read("start.tdms".as_ref())?;
//! println!("{:?}: {} rows", table.names, table.rows());
//! # Ok::<(), im_formats::FormatError>(())
//! ```

use std::fmt;
use std::path::Path;

mod align;
mod comtrade;
mod cursor;
mod error;
#[cfg(feature = "hdf5")]
mod hdf5;
mod mat;
mod mat5;
mod mdf;
mod numbers;
mod tdms;
mod zlib;

pub use align::drawn;
pub use error::FormatError;

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;

/// How many of a file's first bytes [`format_of`] looks at.
pub const FIRST_BYTES: usize = 512;

/// Columns of numbers of one length; NaN where the file has none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// With the unit in brackets where the file gives one: `Speed (rpm)`. No two are equal.
    pub names: Vec<String>,
    /// One per name; time first, where there is any.
    pub columns: Vec<Vec<f64>>,
    /// What was in the file and is not here, and why.
    pub left_out: Vec<String>,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, Vec::len)
    }
}

/// The formats.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// MATLAB, version 5 to 7.
    Mat5,
    /// MATLAB, version 7.3, or HDF5 of another program.
    Hdf5,
    /// ASAM MDF.
    Mdf,
    /// National Instruments TDMS.
    Tdms,
    /// IEEE C37.111, IEC 60255-24.
    Comtrade,
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Mat5 => "MAT file",
            Self::Hdf5 => "MAT 7.3 or HDF5 file",
            Self::Mdf => "MDF file",
            Self::Tdms => "TDMS file",
            Self::Comtrade => "COMTRADE recording",
        })
    }
}

/// The format of a file, by its first [`FIRST_BYTES`]; COMTRADE, which is text, by its name and by the `.cfg` beside a `.dat`.
pub fn format_of(first: &[u8], path: &Path) -> Option<Format> {
    const MAGIC: [(&[u8], Format); 7] = [
        (b"MATLAB 5.0 MAT-file", Format::Mat5),
        (b"MATLAB 7.3 MAT-file", Format::Hdf5),
        (b"\x89HDF\r\n\x1a\n", Format::Hdf5),
        (b"MDF     ", Format::Mdf),
        (b"UnFinMF ", Format::Mdf),
        (b"TDSm", Format::Tdms),
        (b"TDSh", Format::Tdms),
    ];
    let by_magic = MAGIC.iter().find(|(magic, _)| first.starts_with(magic)).map(|(_, format)| *format);
    // The text at the beginning of a MAT file is free; its last bytes are not: version 1, and MI as a number.
    let by_version = || match first.get(124..128) {
        Some(b"\x00\x01IM" | b"\x01\x00MI") => Some(Format::Mat5),
        Some(b"\x00\x02IM" | b"\x02\x00MI") => Some(Format::Hdf5),
        _ => None,
    };
    by_magic.or_else(by_version).or_else(|| comtrade::is_one(first, path).then_some(Format::Comtrade))
}

/// Reads a file that [`format_of`] knows.
///
/// # Errors
/// The file cannot be read, is none of the formats, is cut short or contradicts itself, holds no channel, or is of a kind that is not read.
pub fn read(path: &Path) -> Result<Table, FormatError> {
    let bytes = std::fs::read(path)?;
    match format_of(&bytes[..bytes.len().min(FIRST_BYTES)], path) {
        Some(Format::Mat5) => mat5::read(&bytes),
        #[cfg(feature = "hdf5")]
        Some(Format::Hdf5) => hdf5::read(bytes),
        #[cfg(not(feature = "hdf5"))]
        Some(Format::Hdf5) => Err(FormatError::Unsupported {
            format: Format::Hdf5,
            found: "this build does not read".to_owned(),
            remedy: "build with `--features hdf5`, or save as version 7 (`save -v7`)",
        }),
        Some(Format::Mdf) => mdf::read(&bytes),
        Some(Format::Tdms) => tdms::read(&bytes),
        Some(Format::Comtrade) => comtrade::read(path),
        None => Err(FormatError::Io(std::io::Error::new(
            std::io::ErrorKind::InvalidData,
            "none of MAT, MDF, TDMS and COMTRADE by its first bytes",
        ))),
    }
}
