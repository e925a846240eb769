// The cells of a region on any level: by the table of one level, and below that by the sorted codes, where each cell of each level is
// a run. Who includes this has `codes: array<u32>` besides what region_cells asks for.
//#include place_of
//#include region_cells

/// The first of `low..end` whose code is not below `code`, by steps that double: it is most often near.
fn first_not_below(start: u32, end: u32, code: u32) -> u32 {
    var low = start;
    var step = 1u;
    while (low + step <= end && codes[low + step - 1u] < code) {
        low += step;
        step *= 2u;
    }
    return place_of(code, low, min(low + step - 1u, end));
}

/// Whether a region has a part in the cell, so many levels above the region's, that holds the cell `place`.
fn has_part(r: Region, place: vec3<u32>, above: u32) -> bool {
    let low = vec3<u32>(r.low[0], r.low[1], r.low[2]) >> vec3<u32>(above);
    let high = vec3<u32>(r.high[0], r.high[1], r.high[2]) >> vec3<u32>(above);
    let cell = place >> vec3<u32>(above);
    return all(cell >= low) && all(cell <= high);
}

/// Visits the cells of a region in a run of codes; what is outside the region is passed over in the largest cells that are.
fn visit_run(r: Region, begin: u32, end: u32) {
    let shift = 3u * r.level;
    var i = begin;
    while (i < end) {
        let cell = codes[i] >> shift;
        let place = vec3<u32>(gathered(cell >> 2u), gathered(cell >> 1u), gathered(cell));
        let inside = has_part(r, place, 0u);
        var above = 0u;
        if (!inside) {
            while (!has_part(r, place, above + 1u)) {
                above++;
            }
        }
        let next = first_not_below(i + 1u, end, ((cell >> (3u * above)) + 1u) << (3u * above + shift));
        if (inside) {
            visit_cell(place - vec3<u32>(r.low[0], r.low[1], r.low[2]), i, next);
        }
        i = next;
    }
}

/// Visits the cells of a region that have something in them.
fn visit_region(r: Region, table: u32) {
    if (r.level >= table) {
        visit_cells(r, table);
        return;
    }
    let above = table - r.level;
    for (var z = r.low[2] >> above; z <= r.high[2] >> above; z++) {
        for (var y = r.low[1] >> above; y <= r.high[1] >> above; y++) {
            for (var x = r.low[0] >> above; x <= r.high[0] >> above; x++) {
                let cell = cell_number(x, y, z);
                visit_run(r, cells[cell], cells[cell + 1u]);
            }
        }
    }
}
