// Which pages are on the device, as in the thesis of K. Garanzha (2013, 6.5): for each page three words. The first is the word
// of the pool where the page begins; the second who asks for the page, the one with the least number; the third how often it was
// used. Who includes this has `page_table`.
//#include page_words

/// Who asks for pages.
var<private> asker: u32 = 0u;
/// Whether pages are asked for also where they are there, so that they stay.
var<private> holds: bool = false;
/// Whether a page was not there: what was read is then of no use.
var<private> lacks: bool = false;

/// Asks for a page.
fn ask(page: u32) {
    atomicMin(&page_table[page * PAGE_WORDS + PAGE_ASKER], asker);
}

/// Where a page begins, if it is there, else `ABSENT_PAGE`. Counts the use.
fn page_if_there(page: u32) -> u32 {
    let at = page * PAGE_WORDS;
    let place = atomicLoad(&page_table[at]);
    if (place != ABSENT_PAGE && atomicLoad(&page_table[at + PAGE_USES]) < MOST_USES) {
        atomicAdd(&page_table[at + PAGE_USES], 1u);
    }
    return place;
}

/// Where a page begins; where it is not there it is asked for, and `lacks` is set.
fn page_at(page: u32) -> u32 {
    let place = page_if_there(page);
    if (place == ABSENT_PAGE || holds) {
        ask(page);
    }
    if (place == ABSENT_PAGE) {
        lacks = true;
        return 0u;
    }
    return place;
}
