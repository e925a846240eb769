// How many flags of each tile are set.
//#include compact
//#include select_count
