//! A study as one HTML file: response curves with their bands, and the numbers.

use calibench_report::{Module, chart_page_html};
use serde_json::Value;

const SCRIPT: Module = Module { name: "calibench-lab/study.js", text: include_str!("page.js") };

/// The page of a study; `document` is the output of `sim study --json`, with the `question` if known.
pub fn study_page(document: &Value) -> String {
    chart_page_html("calibench sim study", SCRIPT, &[], document)
}

#[cfg(test)]
mod tests {
    use calibench_report::page_script;
    use serde_json::json;

    use super::*;

    #[test]
    fn names_stay_text_and_the_page_holds_the_whole_document() {
        let document = json!({"question": "</script><script>alert(1)</script>{{SCRIPT}}", "methods": []});
        let page = study_page(&document);
        let script = page_script(SCRIPT, &[]);
        assert!(!page.contains("<script>alert") && page.matches(&script).count() == 1 && !script.contains("</script"));
        assert!(script.contains("function coverage("), "{script}");
        let data = page.split_once(r#"id="data">"#).and_then(|(_, rest)| rest.split_once("</script>")).expect("the data").0;
        assert_eq!(serde_json::from_str::<Value>(data).expect("JSON"), document);
    }
}
