//! The main job: compare the model with measurements, see where it fails, learn which physical effect is missing, add it, and watch
//! the error fall.
//!
//! * [`intake`]: foreign files to experiments, with what is wrong with the data; [`case`]: a motor with its recordings.
//! * [`refine`], [`score`]: the loop, and the scores that nominate; [`diagnosis`]: the verdict, with everything that led to it.
//! * [`localise`], [`leftover`]: where the model fails, and what the residual depends on; [`next_test`]: the manoeuvre that tells rivals apart.
//! * [`report`]: terminal, HTML and JSON.
//!
//! # Features
//!
//! | feature | default | gives |
//! | --- | --- | --- |
//! | `parquet` | no | recordings in Parquet files, with every compression that needs Rust alone |
//! | `parquet-zstd` | no | also those compressed with zstd, for which a C compiler is needed |

pub mod agreement;
pub mod case;
pub mod diagnosis;
pub mod intake;
pub mod leftover;
pub mod localise;
pub mod next_test;
pub mod noise;
pub mod refine;
pub mod report;
pub mod score;
pub mod tables;
