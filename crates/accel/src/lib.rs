//! Acceleration structures: builders, wide layouts, validation.
