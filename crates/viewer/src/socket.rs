//! One connection: what the page says goes to the hub, and news come back.

use crate::command::{Command, Message, parse};
use crate::flow::Flow;
use crate::hub::{Hub, news};
use crate::picture::Frame;
use crate::server::Viewer;
use crate::share;
use crate::view::View;
use axum::body::Bytes;
use axum::extract::ws::{Message as WsMessage, WebSocket};
use serde_json::{Value, json};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use vastlight::scene::generate;

/// Answers that wait for one connection.
const ANSWERS: usize = 32;
/// Longest time that a browser takes for a message; then it is taken to be gone.
const LONGEST_SEND: Duration = Duration::from_secs(30);
/// Messages that cannot be read before a connection is closed.
const PATIENCE: u32 = 100;

/// Serves a connection to its end.
pub(crate) async fn serve(socket: WebSocket, hub: Arc<Hub>, viewer: Arc<Viewer>) {
    let id = hub.join();
    let mut connection = Connection::new(socket, Arc::clone(&hub), viewer, id);
    // A connection that breaks is one that ends.
    let _ = connection.run().await;
    hub.leave(id);
}

/// The connection is gone, or is to be.
struct Gone;

struct Connection {
    socket: WebSocket,
    hub: Arc<Hub>,
    viewer: Arc<Viewer>,
    id: u64,
    flow: Flow,
    answers: mpsc::Sender<Bytes>,
    answered: mpsc::Receiver<Bytes>,
    mistakes: u32,
}

/// What is new since a connection looked last.
struct News {
    frames: watch::Receiver<Option<Frame>>,
    scene: watch::Receiver<Bytes>,
    state: watch::Receiver<Bytes>,
    status: watch::Receiver<Bytes>,
    notices: watch::Receiver<Bytes>,
    closed: watch::Receiver<bool>,
}

impl News {
    /// All that is known is new to one who comes, but old errors.
    fn new(hub: &Hub) -> Self {
        let mut news = Self {
            frames: hub.frames.subscribe(),
            scene: hub.scene.subscribe(),
            state: hub.state.subscribe(),
            status: hub.status.subscribe(),
            notices: hub.notices.subscribe(),
            closed: hub.closed.subscribe(),
        };
        news.frames.mark_changed();
        news.closed.mark_changed();
        for known in [&mut news.scene, &mut news.state, &mut news.status] {
            known.mark_changed();
        }
        news
    }
}

impl Connection {
    fn new(socket: WebSocket, hub: Arc<Hub>, viewer: Arc<Viewer>, id: u64) -> Self {
        let (answers, answered) = mpsc::channel(ANSWERS);
        Self { socket, hub, viewer, id, flow: Flow::default(), answers, answered, mistakes: 0 }
    }

    async fn run(&mut self) -> Result<(), Gone> {
        let mut fresh = News::new(&self.hub);
        self.send(news(&self.hello())).await?;
        loop {
            let may_send = self.flow.may_send();
            tokio::select! {
                biased;
                Ok(()) = fresh.closed.changed() => {
                    let is_closed = *fresh.closed.borrow_and_update();
                    if is_closed {
                        self.send(news(&json!({"kind": "closed"}))).await?;
                        return self.send_message(WsMessage::Close(None)).await;
                    }
                }
                message = self.socket.recv() => match message {
                    Some(Ok(message)) => self.take(message).await?,
                    _ => return Ok(()),
                },
                Some(answer) = self.answered.recv() => self.send(answer).await?,
                Ok(()) = fresh.scene.changed() => self.send_newest(&mut fresh.scene).await?,
                Ok(()) = fresh.state.changed() => self.send_newest(&mut fresh.state).await?,
                Ok(()) = fresh.notices.changed() => self.send_newest(&mut fresh.notices).await?,
                Ok(()) = fresh.frames.changed(), if may_send => {
                    let frame = fresh.frames.borrow_and_update().clone();
                    self.send_frame(frame).await?;
                }
                Ok(()) = fresh.status.changed() => self.send_newest(&mut fresh.status).await?,
            }
        }
    }

    /// What a page needs to know first.
    fn hello(&self) -> Value {
        let View { tone, render, channel, .. } = View::new(self.viewer.spp);
        json!({
            "kind": "hello",
            "id": self.id,
            "version": env!("CARGO_PKG_VERSION"),
            "demos": generate::names(),
            "folder": self.viewer.folder.is_some(),
            "defaults": {"tone": tone, "render": render, "channel": channel},
            "spp_chosen": self.viewer.spp != Viewer::default().spp,
        })
    }

    async fn take(&mut self, message: WsMessage) -> Result<(), Gone> {
        let bytes = match message {
            WsMessage::Binary(bytes) => bytes,
            WsMessage::Close(_) => return Err(Gone),
            WsMessage::Ping(_) | WsMessage::Pong(_) => return Ok(()),
            WsMessage::Text(_) => return self.complain("messages are binary").await,
        };
        match parse(&bytes) {
            Ok(Message::Shown(frame)) => {
                self.flow.confirmed(frame);
                self.hub.set_busy(self.id, !self.flow.may_send());
                Ok(())
            }
            Ok(Message::Do(command)) => self.obey(command).await,
            Err(what) => self.complain(&what).await,
        }
    }

    async fn obey(&mut self, command: Command) -> Result<(), Gone> {
        match command {
            Command::Files { folder } => {
                let viewer = Arc::clone(&self.viewer);
                let listing = tokio::task::spawn_blocking(move || viewer.listing(&folder)).await;
                self.send(news(&listing.map_err(|_| Gone)?)).await
            }
            Command::Share {} => {
                let value = self.shared();
                self.send(news(&value)).await
            }
            command => match self.hub.obey(self.id, command, &self.answers) {
                Ok(()) => Ok(()),
                Err(what) => self.send(news(&error(&what))).await,
            },
        }
    }

    fn shared(&self) -> Value {
        let (view, source) = self.hub.shown();
        match source {
            None => error("no scene is open"),
            Some(source) => {
                let is_own = self.viewer.source.as_deref() == Some(&*source);
                let arguments = if is_own { &self.viewer.scene_arguments[..] } else { &[] };
                let path = self.viewer.source_of(&source).map_or(source, |(path, _)| path);
                share::of_view(&view, &path, arguments)
            }
        }
    }

    /// Says that a message cannot be read; a page that never can be is sent away.
    async fn complain(&mut self, what: &str) -> Result<(), Gone> {
        self.mistakes += 1;
        self.send(news(&error(what))).await?;
        if self.mistakes < PATIENCE { Ok(()) } else { Err(Gone) }
    }

    async fn send_newest(&mut self, of: &mut watch::Receiver<Bytes>) -> Result<(), Gone> {
        let message = of.borrow_and_update().clone();
        if message.is_empty() { Ok(()) } else { self.send(message).await }
    }

    async fn send_frame(&mut self, frame: Option<Frame>) -> Result<(), Gone> {
        let Some(frame) = frame else { return Ok(()) };
        self.flow.sent(frame.number);
        self.hub.set_busy(self.id, !self.flow.may_send());
        self.send(frame.message).await
    }

    async fn send(&mut self, message: Bytes) -> Result<(), Gone> {
        self.send_message(WsMessage::Binary(message)).await
    }

    async fn send_message(&mut self, message: WsMessage) -> Result<(), Gone> {
        match tokio::time::timeout(LONGEST_SEND, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            _ => Err(Gone),
        }
    }
}

fn error(what: &str) -> Value {
    json!({"kind": "error", "what": what, "place": "", "hint": ""})
}
