//! A design as one HTML file: the layout, the map or the front, and the numbers.

use calibench_report::chart_page_html;
use serde_json::Value;

const SCRIPT: &str = include_str!("page.js");

/// The page of a design; `document` is the output of `design --json`.
pub fn design_page(document: &Value) -> String {
    chart_page_html("calibench design", SCRIPT, document)
}
