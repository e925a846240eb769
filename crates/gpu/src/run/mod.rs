//! Running recordings.

mod executor;
mod pipelines;
mod pool;
mod portion;

pub use executor::{Executor, ExecutorConfig, Results};
pub use pipelines::CompileProgress;
