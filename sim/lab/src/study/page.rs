//! A study as one HTML file: response curves with their bands, and the numbers.

use calibench_report::chart_page_html;
use serde_json::Value;

const SCRIPT: &str = include_str!("page.js");

/// The page of a study; `document` is the output of `study --json`, with the `question` if known.
pub fn study_page(document: &Value) -> String {
    chart_page_html("calibench study", SCRIPT, document)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn names_stay_text_and_the_page_holds_the_whole_document() {
        let document = json!({"question": "</script><script>alert(1)</script>{{SCRIPT}}", "methods": []});
        let page = study_page(&document);
        assert!(!page.contains("<script>alert") && page.matches(SCRIPT).count() == 1 && !SCRIPT.contains("</script"));
        let data = page.split_once(r#"id="data">"#).and_then(|(_, rest)| rest.split_once("</script>")).expect("the data").0;
        assert_eq!(serde_json::from_str::<Value>(data).expect("JSON"), document);
    }
}
