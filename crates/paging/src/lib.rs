//! Pages of data in memory inside a budget.
//!
//! [`Table`] says which pages are in memory. Nothing here knows what pages hold.

mod table;

pub use table::{Buffer, Line, Table};
