// The words of a page in the table, and keys of pages: by kind, then those that are asked for, those that are there, the others.

const PAGE_WORDS: u32 = 3u;
const PAGE_ASKER: u32 = 1u;
const PAGE_USES: u32 = 2u;
const ABSENT_PAGE: u32 = 0xffffffffu;
/// Uses are counted up to this.
const MOST_USES: u32 = 31u;
const KIND_SHIFT: u32 = 22u;
const KEY_IS_THERE: u32 = 0x100000u;
const KEY_IS_ABSENT: u32 = 0x200000u;
