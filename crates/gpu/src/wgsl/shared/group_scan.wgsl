// Prefix sums over the invocations of a workgroup: Hillis, Steele 1986, "Data parallel algorithms".
//#include group

var<workgroup> group_sums: array<u32, 512>;

/// x: the sum over the invocations before this one; y: that over all. To be called by all.
fn group_scan(lane: u32, value: u32) -> vec2<u32> {
    var read = 0u;
    group_sums[lane] = value;
    workgroupBarrier();
    for (var distance = 1u; distance < GROUP; distance <<= 1u) {
        let write = GROUP - read;
        var sum = group_sums[read + lane];
        if (lane >= distance) {
            sum += group_sums[read + lane - distance];
        }
        group_sums[write + lane] = sum;
        read = write;
        workgroupBarrier();
    }
    let inclusive = group_sums[read + lane];
    let total = group_sums[read + GROUP - 1u];
    workgroupBarrier();
    return vec2<u32>(inclusive - value, total);
}
