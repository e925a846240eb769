//! Messages without a socket and without a scene, for tests with bytes that nobody trusts.

use crate::command::{Message, parse};
use crate::hub::Hub;
use crate::share;
use crate::view::View;
use tokio::sync::mpsc;
use vastlight::Error;

/// Does what messages from a page say to a view that shows no scene; why some of them were refused.
///
/// # Errors
/// What the page changed makes no override file: then a message was taken that should have been refused.
pub fn rehearse<'m>(messages: impl IntoIterator<Item = &'m [u8]>) -> Result<Vec<String>, Error> {
    let hub = Hub::new(View::new(1), None);
    let viewer = hub.join();
    let (answers, _) = mpsc::channel(1);
    let mut refused = Vec::new();
    for message in messages {
        match parse(message) {
            Ok(Message::Shown(_)) => {}
            Ok(Message::Do(command)) => refused.extend(hub.obey(viewer, command, &answers).err()),
            Err(what) => refused.push(what),
        }
    }
    let view = hub.view();
    share::of_view(&view, "scene.glb", &[]);
    view.edits.overrides()?;
    Ok(refused)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_are_obeyed_or_refused() {
        let edit = b"\x02{\"do\":\"material\",\"name\":\"a\",\"edit\":{\"roughness\":0.5}}";
        let messages: [&[u8]; 4] = [edit, b"\x01abcd", b"\x02{}", b""];
        assert_eq!(rehearse(messages).expect("an override file").len(), 2);
    }
}
