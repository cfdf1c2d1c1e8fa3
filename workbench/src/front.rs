//! The page of the workbench, beside that of a report.

use calibench_report::{Module, modules};

/// Its style sheet.
pub const STYLE: &str = include_str!("page/bench.css");

/// Its markup.
pub const MARKUP: &str = include_str!("page/bench.html");

/// The modules of its script, of which `bench.js` begins the workbench with whatever answers it.
pub const MODULES: &[Module] = modules!("calibench-workbench", "page":
    "actions.js",
    "answers.js",
    "bench.js",
    "candidates.js",
    "figures.js",
    "proposal.js",
    "state.js",
);
