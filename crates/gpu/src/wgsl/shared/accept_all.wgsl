// Every hit counts.

fn accepts(hit: Hit, veiled: bool) -> bool {
    return true;
}
