//! The server: where it listens, what it answers.

use crate::assets::{self, Asset};
use crate::command::LONGEST;
use crate::guard::{Guard, new_token};
use crate::hub::{FileKind, Hub, Snapshot};
use crate::socket;
use crate::stage::Stage;
use crate::view::View;
use axum::Router;
use axum::extract::{Path, Query, Request, State, WebSocketUpgrade};
use axum::http::{HeaderMap, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use serde::Deserialize;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;
use tokio::sync::oneshot;
use vastlight::{CameraChoice, Error, LoadOptions};

/// Time that connections get to hear of the end.
const FAREWELL: Duration = Duration::from_millis(300);

/// What a page shows, and to whom.
#[derive(Clone, Debug)]
pub struct Viewer {
    /// The scene that is opened first: a file, a store, or `demo:NAME`.
    pub source: Option<String>,
    /// How it is opened.
    pub options: LoadOptions,
    /// The same as arguments of a command line, for pages that are asked for one.
    pub scene_arguments: Vec<String>,
    /// From where it is seen first.
    pub camera: CameraChoice,
    /// The folder whose scenes pages may open, and those below it.
    pub folder: Option<PathBuf>,
    /// Largest resident set of the process; `None` for the default budget.
    pub memory: Option<u64>,
    /// Threads that render; `None` for all processors.
    pub threads: Option<usize>,
    /// Samples a pixel of a picture at rest.
    pub spp: u32,
    /// Where to listen.
    pub host: IpAddr,
    /// The port; 0 for a free one.
    pub port: u16,
}

impl Default for Viewer {
    /// No scene, on this machine alone, at a free port.
    fn default() -> Self {
        Self {
            source: None,
            options: LoadOptions::default(),
            scene_arguments: Vec::new(),
            camera: CameraChoice::default(),
            folder: None,
            memory: None,
            threads: None,
            spp: 64,
            host: IpAddr::from([127, 0, 0, 1]),
            port: 0,
        }
    }
}

/// A server at work. It ends when it is dropped.
#[derive(Debug)]
pub struct Server {
    url: String,
    hub: Arc<Hub>,
    stop: Option<oneshot::Sender<()>>,
    threads: Vec<JoinHandle<()>>,
}

/// What answers need.
#[derive(Clone)]
struct Shared {
    hub: Arc<Hub>,
    viewer: Arc<Viewer>,
    guard: Arc<Guard>,
}

impl Server {
    /// Listens, and begins to open the scene.
    ///
    /// # Errors
    /// The address cannot be had, or threads cannot be made.
    pub fn start(viewer: Viewer) -> Result<Self, Error> {
        let place = SocketAddr::new(viewer.host, viewer.port);
        let failed =
            |e: &dyn std::fmt::Display| Error::usage(e.to_string(), place.to_string(), "take another --port");
        let listener = TcpListener::bind(place).map_err(|e| failed(&e))?;
        listener.set_nonblocking(true).map_err(|e| failed(&e))?;
        let address = listener.local_addr().map_err(|e| failed(&e))?;
        let token = new_token().map_err(|e| failed(&e))?;
        let url = format!("http://{address}/?token={token}");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(viewer.threads.unwrap_or(0)).build();
        let pool = pool.map_err(|e| Error::usage(e.to_string(), "--threads", ""))?;
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|e| failed(&e))?;

        let viewer = Arc::new(viewer);
        let hub = Arc::new(Hub::new(View::new(viewer.spp), viewer.source.clone()));
        let stage = Stage::new(Arc::clone(&hub), Arc::clone(&viewer));
        let guard = Arc::new(Guard { token, address: address.ip() });
        let shared = Shared { hub: Arc::clone(&hub), viewer, guard };
        let (stop, stopped) = oneshot::channel();
        let threads = vec![
            std::thread::spawn(move || pool.install(|| stage.run())),
            std::thread::spawn(move || {
                runtime.block_on(listen(listener, shared, stopped));
                runtime.shutdown_timeout(FAREWELL);
            }),
        ];
        Ok(Self { url, hub, stop: Some(stop), threads })
    }

    /// The page's address, with its token.
    #[must_use]
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Samples that were rendered so far, of all pictures.
    #[must_use]
    pub fn rendered_samples(&self) -> u64 {
        self.hub.rendered.load(std::sync::atomic::Ordering::Relaxed)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.hub.close();
        // A thread that ended by itself has nobody to stop, and a panic was reported where it happened.
        let _ = self.stop.take().map(|stop| stop.send(()));
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Answers until it is told to stop; connections hear of the end first.
async fn listen(listener: TcpListener, shared: Shared, stopped: oneshot::Receiver<()>) {
    let Ok(listener) = tokio::net::TcpListener::from_std(listener) else { return };
    let guarded = middleware::from_fn_with_state(shared.clone(), check);
    let router = Router::new()
        .route("/", get(document))
        .route("/page/{token}/{name}", get(asset))
        .route("/ws", get(connect))
        .route("/snapshot.png", get(|state| snapshot(state, FileKind::Png)))
        .route("/snapshot.exr", get(|state| snapshot(state, FileKind::Exr)))
        .layer(guarded)
        .with_state(shared);
    let serving = axum::serve(listener, router);
    tokio::select! {
        _ = serving.into_future() => {}
        _ = stopped => tokio::time::sleep(FAREWELL).await,
    }
}

/// The token of an address.
#[derive(Deserialize)]
struct Token {
    #[serde(default)]
    token: String,
}

/// Refuses requests without the token, for other names, or from other pages; and says to browsers what answers may do.
async fn check(State(shared): State<Shared>, request: Request, next: Next) -> Response {
    if !is_allowed(&shared.guard, &request) {
        let hint = "This page needs the address that `vastlight view` printed, with its token.\n";
        return (StatusCode::FORBIDDEN, hint).into_response();
    }
    let mut response = next.run(request).await;
    response.headers_mut().extend(headers());
    response
}

fn is_allowed(guard: &Guard, request: &Request) -> bool {
    let text = |name| request.headers().get(name).map(|value| value.to_str().unwrap_or_default());
    let by_path = request.uri().path().strip_prefix("/page/").and_then(|rest| rest.split('/').next());
    let by_query =
        || Query::<Token>::try_from_uri(request.uri()).map_or(String::new(), |query| query.0.token);
    let token = by_path.map_or_else(by_query, str::to_owned);
    guard.accepts(text(header::HOST), text(header::ORIGIN)) && guard.knows_token(&token)
}

/// Headers of all answers: nothing from elsewhere, nothing kept, nobody told.
fn headers() -> HeaderMap {
    let policy = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob: data:; \
                  connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";
    let all = [
        (header::CONTENT_SECURITY_POLICY, policy),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::CACHE_CONTROL, "no-store"),
    ];
    all.into_iter().map(|(name, value)| (name, header::HeaderValue::from_static(value))).collect()
}

async fn document(State(shared): State<Shared>) -> Response {
    let html = assets::document(&shared.guard.token);
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], html).into_response()
}

async fn asset(Path((_, name)): Path<(String, String)>) -> Response {
    match assets::named(&name) {
        Some(Asset { kind, text, .. }) => ([(header::CONTENT_TYPE, *kind)], *text).into_response(),
        None => StatusCode::NOT_FOUND.into_response(),
    }
}

async fn connect(State(shared): State<Shared>, upgrade: WebSocketUpgrade) -> Response {
    let Shared { hub, viewer, .. } = shared;
    let upgrade = upgrade.max_message_size(LONGEST).max_frame_size(LONGEST);
    upgrade.on_upgrade(|socket| socket::serve(socket, hub, viewer))
}

/// The picture as a file, as soon as there is one of full size.
async fn snapshot(State(shared): State<Shared>, kind: FileKind) -> Response {
    let (answer, answered) = oneshot::channel();
    if shared.hub.shown().1.is_none() {
        return (StatusCode::CONFLICT, "no scene is open\n").into_response();
    }
    shared.hub.ask_snapshot(Snapshot { kind, answer });
    let (mime, name) = match kind {
        FileKind::Png => ("image/png", "attachment; filename=\"picture.png\""),
        FileKind::Exr => ("image/x-exr", "attachment; filename=\"picture.exr\""),
    };
    match answered.await {
        Ok(Ok(bytes)) => {
            ([(header::CONTENT_TYPE, mime), (header::CONTENT_DISPOSITION, name)], bytes).into_response()
        }
        Ok(Err(error)) => (StatusCode::INTERNAL_SERVER_ERROR, error.to_string()).into_response(),
        Err(_) => (StatusCode::SERVICE_UNAVAILABLE, "there is no picture\n").into_response(),
    }
}
