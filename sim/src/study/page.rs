//! A study as one HTML file: response curves with their bands, and the numbers.

use calibench::report::chart_page_html;
use serde_json::Value;

const SCRIPT: &str = include_str!("page.js");

/// The page of a study, of which `document` is what `study --json` prints, with the `question` where it is known.
pub fn study_page(document: &Value) -> String {
    chart_page_html("calibench study", SCRIPT, document)
}
