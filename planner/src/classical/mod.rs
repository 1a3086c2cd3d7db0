//! Tasks of instantaneous actions over finite-domain variables and numbers, stored in flat arrays.

#[doc(hidden)]
pub mod compiled;
mod measure;
pub(crate) mod numbers;
#[doc(hidden)]
pub mod successor;
