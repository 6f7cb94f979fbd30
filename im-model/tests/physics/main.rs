//! What shows that the model is right: references, conservation, order, sensitivities, frames, and every claim on a card.
#![allow(missing_docs)]

mod bad_input;
mod card_claims;
mod card_shows;
mod closed_forms;
mod frames;
mod lab;
mod modelica;
mod nothing_on;
mod order;
mod own_effect;
mod papers;
mod power_balance;
mod sensitivities;
