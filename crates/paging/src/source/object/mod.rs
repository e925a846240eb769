//! A source on a server: range requests over HTTP(S), and S3-compatible object stores.

#[cfg(test)]
mod server;
#[cfg(test)]
mod tests;

use super::{Source, SourceError, shown};
use futures_util::StreamExt;
use object_store::aws::AmazonS3Builder;
use object_store::http::HttpBuilder;
use object_store::path::Path;
use object_store::{BackoffConfig, ClientOptions, GetOptions, GetRange, ObjectStore, RetryConfig};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;
use url::Url;

/// How patient a source is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectConfig {
    /// Requests that are made again after one failed, with pauses that grow from a tenth of a second to `longest_pause`.
    pub retries: usize,
    /// Longest pause before a request is made again.
    pub longest_pause: Duration,
    /// Time after which an answer is not waited for any longer.
    pub timeout: Duration,
}

impl Default for ObjectConfig {
    /// 6 retries, pauses of up to 5 seconds, half a minute for an answer.
    fn default() -> Self {
        Self { retries: 6, longest_pause: Duration::from_secs(5), timeout: Duration::from_secs(30) }
    }
}

/// An object in a store.
///
/// Threads share a runtime without threads of its own: whoever reads drives it. So nothing here may be called from a
/// task of another runtime.
pub struct ObjectSource {
    name: String,
    /// What messages may not show: the query of the address, which may be a signature.
    secret: Option<String>,
    store: Arc<dyn ObjectStore>,
    path: Path,
    runtime: Runtime,
}

impl std::fmt::Debug for ObjectSource {
    /// Without the store, which knows credentials.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("ObjectSource").field("name", &self.name).finish_non_exhaustive()
    }
}

impl ObjectSource {
    /// An object by its address: `https://host/path`, also with a signature as query, `http://host/path`, or
    /// `s3://bucket/path`; for the last, credentials, region and endpoint are taken from the environment
    /// (`AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`, `AWS_REGION`, `AWS_ENDPOINT`; `AWS_SKIP_SIGNATURE=true` for public
    /// objects). Nothing is asked of the server yet.
    ///
    /// If the process has no provider of cryptography for TLS, ring is made that.
    ///
    /// # Errors
    /// If the address is none of these, or the environment has what contradicts it.
    pub fn open(address: &str, config: ObjectConfig) -> Result<Self, SourceError> {
        let name = shown(address).into_owned();
        let parsed = Url::parse(address).map_err(|error| wrong(&name, &error.to_string()))?;
        // Another provider that is there already is as good.
        let _ = rustls::crypto::ring::default_provider().install_default();
        let store = store_of(&parsed, &name, config)?;
        let path = Path::from_url_path(parsed.path()).map_err(|error| wrong(&name, &error.to_string()))?;
        if path.as_ref().is_empty() {
            return Err(wrong(&name, "the address names no object"));
        }
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        let runtime = runtime.map_err(|error| wrong(&name, &error.to_string()))?;
        Ok(Self { name, secret: parsed.query().map(str::to_owned), store, path, runtime })
    }

    /// Asks for a range and copies what comes; gives how much that was, and the length of the object.
    async fn read_range(&self, offset: u64, into: &mut [u8]) -> object_store::Result<(usize, u64)> {
        let range = GetRange::Bounded(offset..offset.saturating_add(into.len() as u64));
        let options = GetOptions { range: Some(range), ..GetOptions::default() };
        let answer = self.store.get_opts(&self.path, options).await?;
        let bytes = answer.meta.size;
        let mut parts = answer.into_stream();
        let mut done = 0;
        while let Some(part) = parts.next().await {
            let part = part?;
            let Some(place) = into.get_mut(done..done + part.len()) else { break };
            place.copy_from_slice(&part);
            done += part.len();
        }
        Ok((done, bytes))
    }

    fn error(&self, offset: u64, error: &object_store::Error) -> SourceError {
        use object_store::Error as E;
        let hint = match error {
            E::NotFound { .. } => "check the address",
            E::PermissionDenied { .. } | E::Unauthenticated { .. } => {
                "check the credentials, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY; \
                 AWS_SKIP_SIGNATURE=true is for public objects"
            }
            E::NotSupported { .. } => "the server must answer range requests",
            _ => "check the connection and the server; the request was made again as often as was planned",
        };
        let mut what = error.to_string();
        if let Some(secret) = &self.secret {
            what = what.replace(secret.as_str(), "...");
        }
        SourceError { what, name: self.name.clone(), offset, hint }
    }
}

/// What a connection holds of an answer before it is copied, generously.
const CONNECTION_BYTES: usize = 1 << 20;

/// The store that an address lies in.
fn store_of(address: &Url, name: &str, config: ObjectConfig) -> Result<Arc<dyn ObjectStore>, SourceError> {
    let options = ClientOptions::new().with_allow_http(true).with_timeout(config.timeout);
    let init_backoff = Duration::from_millis(100).min(config.longest_pause);
    let retry = RetryConfig {
        backoff: BackoffConfig { init_backoff, max_backoff: config.longest_pause, base: 2.0 },
        max_retries: config.retries,
        retry_timeout: Duration::from_secs(180),
    };
    let failed = |error: object_store::Error| wrong(name, &error.to_string());
    match address.scheme() {
        "http" | "https" => {
            let mut root = address.clone();
            root.set_path("");
            let store = HttpBuilder::new().with_url(root).with_client_options(options).with_retry(retry);
            Ok(Arc::new(store.build().map_err(failed)?))
        }
        "s3" => {
            let bucket = address.host_str().unwrap_or_default();
            let store = AmazonS3Builder::from_env().with_bucket_name(bucket);
            let store = store.with_client_options(options).with_retry(retry);
            Ok(Arc::new(store.build().map_err(failed)?))
        }
        other => Err(wrong(name, &format!("addresses with {other}: are not known"))),
    }
}

fn wrong(name: &str, what: &str) -> SourceError {
    let hint = "give https://host/path, http://host/path or s3://bucket/path";
    SourceError { what: what.to_owned(), name: name.to_owned(), offset: 0, hint }
}

impl Source for ObjectSource {
    fn read(&self, offset: u64, into: &mut [u8]) -> Result<(), SourceError> {
        if into.is_empty() {
            return Ok(());
        }
        let (got, bytes) = self
            .runtime
            .block_on(self.read_range(offset, into))
            .map_err(|error| self.error(offset, &error))?;
        if got < into.len() {
            return Err(SourceError::behind_end(&self.name, offset, into.len(), bytes));
        }
        Ok(())
    }

    /// Asks for the first byte, because not all who may read may ask for the length alone.
    fn bytes(&self) -> Result<u64, SourceError> {
        let first = self.runtime.block_on(self.read_range(0, &mut [0]));
        first.map(|(_, bytes)| bytes).map_err(|error| self.error(0, &error))
    }

    fn name(&self) -> &str {
        &self.name
    }

    fn buffer_bytes(&self, readers: usize) -> usize {
        readers * CONNECTION_BYTES
    }
}
