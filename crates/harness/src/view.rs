//! Messages of the interactive page.

/// Messages, one a line, from somebody who steers.
pub(crate) fn run(bytes: &[u8]) -> bool {
    let messages = bytes.split(|&byte| byte == b'\n');
    let count = messages.clone().count();
    let refused = vastlight_viewer::rehearse(messages).expect("what was taken makes sense");
    assert!(refused.iter().all(|what| !what.is_empty()));
    refused.len() < count
}
