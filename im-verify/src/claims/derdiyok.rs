//! The sliding-mode observer of Derdiyok et al. (Kwon et al., Section IV).

use crate::claim::Claim;

/// The claims.
pub const CLAIMS: &[Claim] = &[];
