//! The page of the workbench, beside that of a report.

/// Its style sheet.
pub const STYLE: &str = include_str!("page/bench.css");

/// Its markup.
pub const MARKUP: &str = include_str!("page/bench.html");

/// Its script, after that of whatever answers it: `backend`.
pub const SCRIPT: &str = include_str!("page/bench.js");
