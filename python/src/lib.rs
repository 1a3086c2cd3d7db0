//! Extension module of the Python package `descry`, on top of the crates behind the command line.

mod again;
mod agent;
mod arrays;
mod attachment;
mod convert;
mod failure;
mod function;
mod planning;
mod recognise;
mod record;
mod task;
mod watch;
mod why_not;

use pyo3::prelude::*;

/// Native module `descry._descry`; users import `descry`.
#[pymodule]
mod _descry {
    #[pymodule_export]
    use super::again::{Replay, replay, resume};
    #[pymodule_export]
    use super::agent::{Report, check_robot, goals, new_domain, pursue};
    #[pymodule_export]
    use super::attachment::{Attachment, Call};
    #[pymodule_export]
    use super::failure::Finding;
    #[pymodule_export]
    use super::planning::{Outcome, Verdict, plan, validate};
    #[pymodule_export]
    use super::recognise::{Percept, Recognition, Surface, read_cloud, recognise};
    #[pymodule_export]
    use super::record::{Document, Record};
    #[pymodule_export]
    use super::task::{Plan, Step, Task, check};
    #[pymodule_export]
    use super::why_not::{WhyNot, why_not};
}
