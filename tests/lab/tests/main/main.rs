//! What takes several crates to show: observers and drives on simulated machines, and designs on the code that runs them.

mod anything;
mod designs;
mod drive;
mod observers;
