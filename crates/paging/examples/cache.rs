//! How fast a cache serves batches of work: threads walk a tree of pages, a page at a time has something to be done with.
//!
//! `cache [--policy P] [--source memory|keep|bypass] [--slots PART] [--threads N] [--page BYTES] [--work N] [--ahead N]`
#![allow(clippy::print_stdout, reason = "it is there to print")]

use std::collections::BTreeSet;
use std::io::Write;
use std::sync::Arc;
use std::time::Instant;
use vastlight_paging::policy::traces;
use vastlight_paging::{
    CacheConfig, Directory, FileSource, KernelCache, MemorySource, PageCache, PageEntry, Source,
};

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn argument<T: std::str::FromStr>(name: &str, default: T) -> T {
    let mut arguments = std::env::args().skip_while(|argument| argument != name).skip(1);
    arguments.next().and_then(|text| text.parse().ok()).unwrap_or(default)
}

/// Pages of noise in a file of the working folder's disk, and in memory.
fn pages(count: u32, page_bytes: usize) -> Result<(tempfile::TempPath, Vec<u8>, Directory), Failure> {
    let mut noise = 1_u64;
    let mut next = || {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        noise.to_be_bytes()
    };
    let bytes: Vec<u8> = (0..count as usize * page_bytes / 8).flat_map(|_| next()).collect();
    let entries = bytes.chunks(page_bytes).enumerate();
    let directory = entries.map(|(n, page)| PageEntry::of((n * page_bytes) as u64, page)).collect();
    let mut file = tempfile::NamedTempFile::new_in(".")?;
    file.write_all(&bytes)?;
    file.as_file().sync_all()?;
    Ok((file.into_temp_path(), bytes, directory))
}

/// Walks its part of the trace, `pass` pages a pass; what is missing waits for the next.
fn walk(cache: &PageCache, trace: &[u32], pass: usize, work: usize) -> Result<u32, Failure> {
    let mut batch = cache.batch()?;
    let mut sum = 0;
    for uses in trace.chunks(pass) {
        let mut left: Vec<u32> = uses.iter().copied().collect::<BTreeSet<u32>>().into_iter().collect();
        while !left.is_empty() {
            let (table, usage) = batch.parts();
            left.retain(|&page| match table.page(page) {
                Some(bytes) => {
                    usage.add(page);
                    (0..work).for_each(|_| sum ^= crc32fast::hash(bytes));
                    false
                }
                None => true,
            });
            batch.fetch(&left)?;
        }
    }
    Ok(sum)
}

fn main() -> Result<(), Failure> {
    let (page_bytes, threads) = (argument("--page", 65_536_usize), argument("--threads", 6_usize));
    let count = (argument("--mib", 1024_usize) << 20) as u32 / page_bytes as u32;
    let (path, bytes, directory) = pages(count, page_bytes)?;
    let source: Arc<dyn Source> = match argument("--source", String::from("keep")).as_str() {
        "memory" => Arc::new(MemorySource::new("memory", bytes)),
        "bypass" => Arc::new(FileSource::open(&path, KernelCache::Bypass)?),
        _ => Arc::new(FileSource::open(&path, KernelCache::Keep)?),
    };
    let slots = ((f64::from(count) * argument("--slots", 0.05)) as usize).max(threads);
    let config = CacheConfig {
        policy: argument("--policy", vastlight_paging::PolicyKind::default()),
        most_batches: threads,
        io_threads: argument("--io", 2),
        read_ahead: argument("--ahead", 0),
        reserve: (slots as f64 * argument("--reserve", 0.5)) as usize,
        ..CacheConfig::new(slots, page_bytes)
    };
    let cache = PageCache::new(source, directory, config)?;
    let (uses, work) = (argument("--uses", 200_000_usize), argument("--work", 1_usize));
    let trace = traces::all(count, uses).pop().map(|(_, trace)| trace).unwrap_or_default();
    let start = Instant::now();
    std::thread::scope(|scope| {
        let parts = trace.chunks(trace.len().div_ceil(threads));
        let walks: Vec<_> = parts.map(|part| scope.spawn(|| walk(&cache, part, 256, work))).collect();
        walks.into_iter().try_for_each(|walk| walk.join().map_err(|_| "a thread panicked")?.map(drop))
    })?;
    let (time, stats) = (start.elapsed().as_secs_f64(), cache.stats());
    println!(
        "{:8} {slots:6} slots of {count:6}: {:6.2} s, {:5.1}% missed, {:6.0} MiB read in {:6} reads, {:5.1} s stalled, revived {}, evicted {}",
        config.policy.name(),
        time,
        stats.misses as f64 / stats.hits.max(1) as f64 * 100.0,
        stats.bytes_read as f64 / f64::from(1 << 20),
        stats.reads,
        stats.stall.as_secs_f64(),
        stats.pages_revived,
        stats.evictions,
    );
    Ok(())
}
