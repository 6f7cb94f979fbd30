//! Controllers, loops and the drive around them, each on its own.

mod alone;
mod bounds;
mod field_weakening;
mod loops;
mod sampled;
mod supervision;
