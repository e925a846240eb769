// A pyramid of boxes: a box of each level is around four of the level below. Who includes this has a `pyramid: array<Box>`.
//#include boxes
//#include group

/// Levels that a dispatch adds.
const LEVELS: u32 = 4u;

var<workgroup> tile_boxes: array<Box, GROUP>;

/// Writes the levels above one that has `length` boxes from `first` on, of which the workgroup `tile` holds one an invocation.
/// To be called by all.
fn write_levels(lane: u32, tile: u32, first: u32, length: u32, own: Box) {
    tile_boxes[lane] = own;
    var from_place = first;
    var above = length;
    var width = GROUP / 4u;
    for (var level = 0u; level < LEVELS; level++) {
        workgroupBarrier();
        var around = empty_box();
        if (lane < width) {
            for (var k = 0u; k < 4u; k++) {
                around = join(around, tile_boxes[4u * lane + k]);
            }
        }
        workgroupBarrier();
        from_place += above;
        above = (above + 3u) / 4u;
        let i = tile * width + lane;
        if (lane < width) {
            tile_boxes[lane] = around;
            if (i < above) {
                pyramid[from_place + i] = around;
            }
        }
        width /= 4u;
    }
}
