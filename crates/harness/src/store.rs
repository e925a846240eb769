//! Stores.

use crate::scene::check;
use crate::{limits, seal};
use std::sync::Arc;
use vastlight::import::LoadOptions as ImportOptions;
use vastlight::paging::MemorySource;
use vastlight::store::MOST_PAGE_BYTES;
use vastlight::{LoadOptions, Overrides, open_store};

/// A store as it is, and with the checksums that it should have.
pub(crate) fn run(bytes: &[u8]) {
    open(bytes.to_vec());
    if let Some(sealed) = seal::store(bytes) {
        open(sealed);
    }
}

fn open(bytes: Vec<u8>) {
    let length = bytes.len() as u64;
    let import = ImportOptions { limits: limits(), ..ImportOptions::default() };
    // A sky takes longer than all the rest.
    let day = Overrides::parse("environment.color = [1, 1, 1]", "day").expect("an override");
    let options = LoadOptions { import, overrides: vec![day], ..LoadOptions::default() };
    let source = Arc::new(MemorySource::new("a store", bytes));
    let Ok(open) = open_store(source, &options) else { return };
    assert!(!open.scene.cameras().is_empty() && !open.scene.materials().is_empty());
    let stored = open.stored.as_ref().expect("a store has pages");
    assert_eq!(stored.meshes.len(), open.scene.meshes().len());
    for directory in [&stored.geometry, &stored.attributes, &stored.tiles] {
        let entries = (0..directory.pages() as u32).filter_map(|page| directory.get(page));
        for entry in entries {
            assert!(entry.bytes <= MOST_PAGE_BYTES && entry.end() <= length);
        }
    }
    check::picture(&open);
}
