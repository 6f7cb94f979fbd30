//! Controllers, loops and the drive around them, each on its own.

mod alone;
mod bounds;
mod loops;
mod supervision;
