// How many runs of equal keys start in each tile.
//#include runs
//#include select_count
