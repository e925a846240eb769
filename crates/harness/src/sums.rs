//! Pictures under way (.vlc).

use crate::scratch::Scratch;
use crate::seal;
use std::path::Path;
use vastlight::film::{Accumulator, SumsFile, write_sums};

/// A file of sums as it is, and with the checksums that it should have.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let taken = read(bytes);
    seal::sums(bytes).is_some_and(|sealed| read(&sealed)) || taken
}

/// What is read and written is read as the same again: equal sums are equal bytes.
fn read(bytes: &[u8]) -> bool {
    let scratch = Scratch::with(&[("picture.vlc", bytes)]);
    let Some(sums) = load(&scratch.path("picture.vlc"), 16) else { return false };
    let [first, second] = ["first.vlc", "second.vlc"].map(|name| scratch.path(name));
    write_sums(&first, &sums).expect("the folder takes files");
    let again = load(&first, 64).expect("what is written can be read");
    write_sums(&second, &again).expect("the folder takes files");
    let [first, second] = [first, second].map(|path| std::fs::read(path).expect("just written"));
    assert_eq!(first.len(), bytes.len());
    assert!(first == second, "written and read again it is another picture");
    let _ = sums.develop();
    true
}

fn load(path: &Path, tile: u32) -> Option<Accumulator> {
    let file = SumsFile::open(path).ok()?;
    let (settings, recipe) = (file.settings(), file.recipe().clone());
    let sums = file.load(tile).ok()?;
    assert!(sums.film().settings().records_the_same(&settings) && sums.recipe == recipe);
    Some(sums)
}
