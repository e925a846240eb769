//! Object sources against a server that fails now and then.

use super::server::{Answer, Server};
use super::*;
use crate::{CacheConfig, Directory, PageCache};

const QUICK: ObjectConfig = ObjectConfig {
    retries: 3,
    longest_pause: Duration::from_millis(20),
    timeout: Duration::from_millis(500),
};

fn file() -> Vec<u8> {
    (0..100_000_u32).map(|i| (i * 31 + i / 255) as u8).collect()
}

fn read(source: &ObjectSource, offset: u64, bytes: usize) -> Result<Vec<u8>, SourceError> {
    let mut into = vec![0; bytes];
    source.read(offset, &mut into).map(|()| into)
}

#[test]
fn ranges_come_from_the_right_place() {
    let all = file();
    let server = Server::start(all.clone(), |_| Answer::Right);
    let source = ObjectSource::open(&server.address(), QUICK).expect("an address");
    assert_eq!(source.bytes(), Ok(all.len() as u64));
    for (offset, bytes) in [(0, 1), (0, 100_000), (4096, 4096), (99_999, 1), (5, 0)] {
        let end = offset as usize + bytes;
        assert_eq!(read(&source, offset, bytes).as_deref(), Ok(&all[offset as usize..end]));
    }
    for (offset, bytes) in [(99_999, 2), (100_000, 1), (u64::MAX - 3, 10)] {
        let error = read(&source, offset, bytes).expect_err("behind the end");
        assert_eq!((error.offset, error.name), (offset, server.address()));
    }
}

#[test]
fn failures_that_pass_are_not_seen() {
    let all = file();
    for bad in [
        Answer::Status("503 Slow Down"),
        Answer::HangUp,
        Answer::Half,
        Answer::Late(Duration::from_millis(900)),
        Answer::Status("429 Too Many Requests"),
    ] {
        let server = Server::start(all.clone(), move |number| if number < 2 { bad } else { Answer::Right });
        let source = ObjectSource::open(&server.address(), QUICK).expect("an address");
        assert_eq!(read(&source, 1000, 50_000).as_deref(), Ok(&all[1000..51_000]), "{bad:?}");
        assert_eq!(server.requests(), 3, "{bad:?}");
    }
}

#[test]
fn failures_that_last_are_errors_with_a_hint() {
    let cases = [
        (Answer::Status("500 Internal Server Error"), 4, "500", "check the connection"),
        (Answer::HangUp, 4, "", "check the connection"),
        (Answer::Status("403 Forbidden"), 1, "403", "check the credentials"),
        (Answer::Status("404 Not Found"), 1, "404", "check the address"),
        (Answer::Whole, 1, "ange", "the server must answer range requests"),
    ];
    for (bad, requests, what, hint) in cases {
        let server = Server::start(file(), move |_| bad);
        let address = server.address() + "?signature=s3cr3t";
        let source = ObjectSource::open(&address, QUICK).expect("an address");
        let error = read(&source, 7, 9).expect_err("fails");
        assert!(error.what.contains(what) && error.hint.starts_with(hint), "{bad:?}: {error}");
        assert!(!error.to_string().contains("s3cr3t"), "{error}");
        assert_eq!((error.offset, error.name, server.requests()), (7, server.address(), requests), "{bad:?}");
    }
}

#[test]
fn a_server_that_is_not_there_is_an_error() {
    let address = Server::start(Vec::new(), |_| Answer::Right).address();
    let source = ObjectSource::open(&address, QUICK).expect("an address");
    assert!(source.bytes().expect_err("nobody listens").hint.starts_with("check the connection"));
}

#[test]
fn addresses_of_other_kinds_are_errors() {
    for address in
        ["", "scene.vls", "ftp://host/scene.vls", "/a/b", "http://", "s3:", "s3://bucket", "http://host"]
    {
        let error = ObjectSource::open(address, QUICK).expect_err(address);
        assert!(error.hint.starts_with("give https://"), "{address}: {error}");
    }
    let error = ObjectSource::open("gopher://me:secret@host/x?secret=1", QUICK).expect_err("gopher");
    assert!(!error.to_string().contains("secret"), "{error}");
}

#[test]
fn an_s3_store_is_asked_for_the_key_in_the_bucket() {
    let all = file();
    let server = Server::start(all.clone(), |_| Answer::Right);
    let store = AmazonS3Builder::new()
        .with_endpoint(server.host())
        .with_bucket_name("bucket")
        .with_region("here")
        .with_access_key_id("id")
        .with_secret_access_key("key")
        .with_client_options(ClientOptions::new().with_allow_http(true));
    let mut source = ObjectSource::open(&server.address(), QUICK).expect("an address");
    source.store = Arc::new(store.build().expect("a store"));
    assert_eq!(read(&source, 10, 20).as_deref(), Ok(&all[10..30]));
}

/// A cache over a slow server that fails two of five requests: all pages come.
#[test]
fn a_cache_reads_from_a_server() {
    let pages: Vec<Vec<u8>> = (0..60_u8).map(|number| vec![number; 3000]).collect();
    let server = Server::start(pages.concat(), |number| match number % 5 {
        1 => Answer::Status("503 Slow Down"),
        3 => Answer::Half,
        _ => Answer::Late(Duration::from_millis(20)),
    });
    let patient = ObjectConfig { retries: 30, ..QUICK };
    let source = ObjectSource::open(&server.address(), patient).expect("an address");
    let config = CacheConfig {
        io_threads: 8,
        reserve: 0,
        most_batches: 1,
        read_bytes: 12_000,
        ..CacheConfig::new(60, 4096)
    };
    let cache = PageCache::new(Arc::new(source), Directory::packed(0, &pages), config).expect("sizes fit");
    let mut batch = cache.batch().expect("first");
    assert_eq!(batch.fetch(&(0..60).collect::<Vec<_>>()), Ok(60));
    assert!((0..60).all(|page| batch.table().page(page).is_some_and(|m| m[..3000] == pages[page as usize])));
    assert!(cache.stats().reads < 40, "pages are read together: {:?}", cache.stats());
}
