//! Traces made up for replays.

/// Uses of pages by name of the kind of trace, over so many pages and about so many uses.
#[must_use]
pub fn all(pages: u32, uses: usize) -> Vec<(&'static str, Vec<u32>)> {
    vec![
        ("even", even(pages, uses)),
        ("zipf 0.8", zipf(pages, uses, 0.8)),
        ("zipf 1.1", zipf(pages, uses, 1.1)),
        ("loop over a fifth", repeat(pages / 5, uses)),
        ("hot set and sweeps", hot_and_sweeps(pages, uses)),
        ("hot set that moves", moving(pages, uses)),
        ("tree", tree(pages, uses)),
    ]
}

/// Numbers in [0, 1) from a seed.
struct Units(u64);

impl Units {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1_u64 << 31) as f64
    }

    fn below(&mut self, end: u32) -> u32 {
        ((self.next() * f64::from(end)) as u32).min(end.saturating_sub(1))
    }
}

/// All pages alike.
fn even(pages: u32, uses: usize) -> Vec<u32> {
    let mut units = Units(1);
    (0..uses).map(|_| units.below(pages)).collect()
}

/// The page of rank r is used in proportion to 1 / r^power.
fn zipf(pages: u32, uses: usize, power: f64) -> Vec<u32> {
    let mut units = Units(2);
    let mut sum = 0.0;
    let sums: Vec<f64> = (0..pages)
        .map(|rank| {
            sum += (f64::from(rank) + 1.0).powf(-power);
            sum
        })
        .collect();
    // Ranks are spread over the pages, so that numbers say nothing.
    let page = |rank: usize| ((rank as u64 * 7919 + 13) % u64::from(pages)) as u32;
    (0..uses).map(|_| page(sums.partition_point(|&s| s < units.next() * sum).min(sums.len() - 1))).collect()
}

/// The same pages again and again in the same order.
fn repeat(pages: u32, uses: usize) -> Vec<u32> {
    (0..pages.max(1)).cycle().take(uses).collect()
}

/// Half of the uses go to a twentieth of the pages, the other half goes over all of them in order.
fn hot_and_sweeps(pages: u32, uses: usize) -> Vec<u32> {
    let mut units = Units(3);
    let hot = (pages / 20).max(1);
    let page = |i: usize| if i.is_multiple_of(2) { units.below(hot) } else { (i / 2) as u32 % pages };
    (0..uses).map(page).collect()
}

/// Nine of ten uses go to a twentieth of the pages, another one after each tenth of the trace.
fn moving(pages: u32, uses: usize) -> Vec<u32> {
    let mut units = Units(4);
    let hot = (pages / 20).max(1);
    let phase = (uses / 10).max(1);
    let page = |i: usize| {
        let start = (i / phase) as u32 * hot;
        if units.next() < 0.9 { (start + units.below(hot)) % pages } else { units.below(pages) }
    };
    (0..uses).map(page).collect()
}

/// Walks from the root of a tree of pages, four children each, to a leaf near the last one: what rays do.
fn tree(pages: u32, uses: usize) -> Vec<u32> {
    let mut units = Units(5);
    let mut trace = Vec::with_capacity(uses);
    let mut place = 0.5;
    while trace.len() < uses {
        let far = units.next() < 0.2;
        place = if far { units.next() } else { (place + (units.next() - 0.5) * 0.02).clamp(0.0, 0.999_999) };
        let (mut node, mut rest) = (0, place);
        while node < pages {
            trace.push(node);
            let child = (rest * 4.0).floor();
            rest = rest * 4.0 - child;
            node = node * 4 + 1 + child as u32;
        }
    }
    trace.truncate(uses);
    trace
}
