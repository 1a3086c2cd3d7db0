//! The extension module of the Python package `descry`: what Python calls, on the crates that the command line is made of.

mod attachment;
mod convert;
mod failure;
mod planning;
mod task;
mod watch;

use pyo3::prelude::*;

/// Loaded as `descry._descry`; people import `descry`.
#[pymodule]
mod _descry {
    #[pymodule_export]
    use super::attachment::{Attachment, Call};
    #[pymodule_export]
    use super::failure::Finding;
    #[pymodule_export]
    use super::planning::{Outcome, Verdict, plan, validate};
    #[pymodule_export]
    use super::task::{Plan, Step, Task, check};
}
