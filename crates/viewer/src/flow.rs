//! Flow control of one connection: few pictures on their way, and the newest next.

use std::collections::VecDeque;

/// Most pictures that a browser has not confirmed.
const MOST: usize = 2;

/// Pictures that were sent and not confirmed.
#[derive(Debug, Default)]
pub(crate) struct Flow {
    pending: VecDeque<u32>,
}

impl Flow {
    /// Whether another picture may be sent.
    pub(crate) fn may_send(&self) -> bool {
        self.pending.len() < MOST
    }

    /// Notes a picture that is sent.
    pub(crate) fn sent(&mut self, frame: u32) {
        self.pending.push_back(frame);
    }

    /// Takes a confirmation, of that picture and of all before it; others than those on their way mean nothing.
    pub(crate) fn confirmed(&mut self, frame: u32) {
        if let Some(place) = self.pending.iter().position(|&pending| pending == frame) {
            self.pending.drain(..=place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_are_on_their_way_and_no_more() {
        let mut flow = Flow::default();
        flow.sent(7);
        assert!(flow.may_send());
        flow.sent(9);
        assert!(!flow.may_send());
        flow.confirmed(8);
        assert!(!flow.may_send(), "no such picture");
        flow.confirmed(9);
        assert!(flow.may_send());
        flow.sent(10);
        assert!(flow.may_send(), "the one before a confirmed one is confirmed");
    }
}
