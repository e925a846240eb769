// Every hit counts.

fn accepts(hit: Hit) -> bool {
    return true;
}
