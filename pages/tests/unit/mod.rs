//! Tests of single modules.

mod gantt;
mod live_answers;
mod page;
mod page_points;
