// Moves keys and their payloads to their places in the order of a digit.
//#include radix_emit

@group(0) @binding(4) var<storage, read> payloads: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_payloads: array<u32>;

fn carry(origin: u32, place: u32) {
    sorted_payloads[place] = payloads[origin];
}
