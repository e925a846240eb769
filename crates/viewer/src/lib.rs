//! The interactive page: a server that renders while browsers watch, and one of them steers.
//!
//! A [`Server`] listens on an address, hands out the page, and speaks with it over one WebSocket (`docs/viewer.md` has the messages).
//! Connections (`socket`) change what is looked at (`view`) in one place (`hub`); a thread of its own (`stage`) renders that and
//! publishes pictures, of which each connection takes the newest when its browser has shown those before (`flow`).

mod assets;
mod command;
mod develop;
mod edits;
mod files;
mod flow;
mod guard;
mod hub;
mod inventory;
mod meter;
mod objects;
mod picture;
mod rehearsal;
mod server;
mod share;
mod socket;
mod stage;
mod view;

pub use rehearsal::rehearse;
pub use server::{Server, Viewer};
