//! Stores.

use crate::scene::check;
use crate::{limits, seal};
use std::sync::Arc;
use vastlight::import::LoadOptions as ImportOptions;
use vastlight::paging::MemorySource;
use vastlight::store::MOST_PAGE_BYTES;
use vastlight::{Error, LoadOptions, OpenScene, Overrides, open_store};

/// A store as it is, and with the checksums that it should have.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let taken = try_out(bytes.to_vec());
    seal::store(bytes).is_some_and(try_out) || taken
}

fn open(bytes: Vec<u8>) -> Result<OpenScene, Error> {
    let import = ImportOptions { limits: limits(), ..ImportOptions::default() };
    // A sky takes longer than all the rest.
    let day = Overrides::parse("environment.color = [1, 1, 1]", "day").expect("an override");
    let options = LoadOptions { import, overrides: vec![day], ..LoadOptions::default() };
    let source = Arc::new(MemorySource::new("a store", bytes));
    open_store(source, &options)
}

/// Whether they are a store.
fn try_out(bytes: Vec<u8>) -> bool {
    let length = bytes.len() as u64;
    let Ok(mut open) = open(bytes) else { return false };
    assert!(!open.scene.cameras().is_empty() && !open.scene.materials().is_empty());
    let stored = open.stored.as_ref().expect("a store has pages");
    assert_eq!(stored.meshes.len(), open.scene.meshes().len());
    for directory in [&stored.geometry, &stored.attributes, &stored.tiles] {
        let entries = (0..directory.pages() as u32).filter_map(|page| directory.get(page));
        for entry in entries {
            assert!(entry.bytes <= MOST_PAGE_BYTES && entry.end() <= length);
        }
    }
    check::moments(&mut open.scene);
    check::picture(&open);
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::seed;
    use vastlight::store::format::VERSION;

    /// Of that version, with right checksums.
    fn of_version(version: u32) -> Result<OpenScene, Error> {
        let mut bytes = seed("store", "animated.vls");
        bytes[8..12].copy_from_slice(&version.to_le_bytes());
        open(seal::store(&bytes).expect("a table of sections"))
    }

    #[test]
    fn stored_movements_are_posed() {
        let mut open = open(seed("store", "animated.vls")).expect("a store");
        let at_rest = open.scene.instances().get(0);
        check::moments(&mut open.scene);
        assert!(at_rest.is_some() && open.scene.instances().get(0) != at_rest);
    }

    /// Movements were recorded otherwise in version 4.
    #[test]
    fn an_older_movement_is_refused_for_its_version() {
        assert!(of_version(VERSION).expect("a store").scene.motion().is_some());
        let Err(error) = of_version(4) else { panic!("it is read") };
        assert!(error.to_string().contains("version 4") && error.hint.contains("pack"), "{error}");
    }
}
