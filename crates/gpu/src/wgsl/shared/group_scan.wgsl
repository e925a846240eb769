// Prefix sums over the invocations of a workgroup, in two levels: Chatterjee, Blelloch, Zagha 1990, "Scan primitives for
// vector computers". Two barriers instead of the eight of a scan by doubling: they are what a scan without
// subgroups spends its time on.
//#include group

/// Invocations whose values one of them adds up.
const ROW: u32 = 16u;

var<workgroup> row_values: array<u32, GROUP>;
var<workgroup> row_sums: array<u32, GROUP / ROW>;

/// x: the sum over the invocations before this one; y: that over all. To be called by all.
fn group_scan(lane: u32, value: u32) -> vec2<u32> {
    row_values[lane] = value;
    workgroupBarrier();
    if (lane < GROUP / ROW) {
        var sum = 0u;
        for (var i = 0u; i < ROW; i++) {
            let next = row_values[lane * ROW + i];
            row_values[lane * ROW + i] = sum;
            sum += next;
        }
        row_sums[lane] = sum;
    }
    workgroupBarrier();
    var before = row_values[lane];
    var total = 0u;
    for (var row = 0u; row < GROUP / ROW; row++) {
        if (row == lane / ROW) {
            before += total;
        }
        total += row_sums[row];
    }
    workgroupBarrier();
    return vec2<u32>(before, total);
}
