//! Accumulators that merge to the same bits, tone curves, image files.
