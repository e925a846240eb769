// The cells of a region, by a table of how many elements come before each cell of a level. Who includes this has `cells: array<u32>`,
// that table, and `visit_cell`, which is told of a cell's place in the region and of the elements in it.
//#include region

/// Visits the cells of a region, not finer than those of the table, that have something in them.
fn visit_cells(r: Region, table: u32) {
    let shift = 3u * (r.level - table);
    for (var z = r.low[2]; z <= r.high[2]; z++) {
        for (var y = r.low[1]; y <= r.high[1]; y++) {
            for (var x = r.low[0]; x <= r.high[0]; x++) {
                let cell = cell_number(x, y, z) << shift;
                let begin = cells[cell];
                let end = cells[cell + (1u << shift)];
                if (begin < end) {
                    visit_cell(vec3<u32>(x - r.low[0], y - r.low[1], z - r.low[2]), begin, end);
                }
            }
        }
    }
}
