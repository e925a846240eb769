//! Pictures under way (.vlc).

use crate::scratch::Scratch;
use crate::seal;
use vastlight::film::{SumsFile, write_sums};

/// A file of sums as it is, and with the checksums that it should have.
pub(crate) fn run(bytes: &[u8]) {
    read(bytes);
    if let Some(sealed) = seal::sums(bytes) {
        read(&sealed);
    }
}

/// Equal sums are equal bytes: what is read is written as it was.
fn read(bytes: &[u8]) {
    let scratch = Scratch::with(&[("picture.vlc", bytes)]);
    let Ok(file) = SumsFile::open(&scratch.path("picture.vlc")) else { return };
    let (settings, recipe) = (file.settings(), file.recipe().clone());
    let Ok(sums) = file.load(16) else { return };
    assert!(sums.film().settings().records_the_same(&settings) && sums.recipe == recipe);
    let again = scratch.path("again.vlc");
    write_sums(&again, &sums).expect("the folder takes files");
    assert!(std::fs::read(&again).expect("just written") == bytes, "it is written in another way");
    let _ = sums.develop();
}
