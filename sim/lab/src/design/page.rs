//! A design as one HTML file: the layout, the map or the front, and the numbers.

use calibench_report::{Module, chart_page_html};
use serde_json::Value;

const SCRIPT: Module = Module { name: "calibench-lab/design.js", text: include_str!("page.js") };

/// The page of a design; `document` is the output of `sim design --json`.
pub fn design_page(document: &Value) -> String {
    chart_page_html("calibench sim design", SCRIPT, &[], document)
}

#[cfg(test)]
mod tests {
    use calibench_report::page_script;

    use super::*;

    #[test]
    fn the_modules_of_its_script_fit_together() {
        let script = page_script(SCRIPT, &[]);
        assert!(script.contains("function layout("), "{script}");
    }
}
