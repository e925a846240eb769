// Moves keys to their places in the order of a digit.
//#include radix_emit

fn carry(origin: u32, place: u32) {}
