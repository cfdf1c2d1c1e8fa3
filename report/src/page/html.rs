//! The document in one self-contained HTML file.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::script::{Module, linked_or_told};
use crate::modules;

const PAGE: &str = include_str!("index.html");
const CHART_PAGE: &str = include_str!("charts.html");
const STYLE: &str = include_str!("page.css");
/// The three indicators on their ball.
const ICON: &str = include_str!("icon.svg");
/// Modules that every page can import.
const MODULES: &[Module] = modules!("calibench-report", ".":
    "accuracy.js",
    "against.js",
    "candidates.js",
    "centring.js",
    "charts.js",
    "contents.js",
    "contributions.js",
    "drawing.js",
    "drawn.js",
    "elements.js",
    "eye.js",
    "falling.js",
    "handling.js",
    "heat_map.js",
    "key.js",
    "linked.js",
    "maps.js",
    "models.js",
    "options.js",
    "painting.js",
    "panels.js",
    "parameters.js",
    "poses.js",
    "provenance.js",
    "ranges.js",
    "redraw.js",
    "render.js",
    "residuals.js",
    "scales.js",
    "scene.js",
    "space.js",
    "telling.js",
    "text.js",
    "theme.js",
    "told.js",
    "two_models.js",
    "verdict.js",
    "workspace.js",
);
/// Script that runs before anything is drawn.
const HEAD: Module = Module { name: "calibench-report/head.js", text: include_str!("head.js") };
/// The script of a report.
const REPORT: Module = Module { name: "calibench-report/report.js", text: include_str!("report.js") };
const CHARTS: &str = include_str!("echarts/echarts.min.js");
const NOTICE: &str = include_str!("echarts/NOTICE");

/// Content security policy of a report: the browser may only draw it.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:";

/// The HTML page of a report.
///
/// The document remains text: `<`, `>` and `&` are written as JSON escapes, so no name can end the element that holds it, and
/// the script creates no markup from it.
pub fn page_html(document: &Value) -> String {
    let script = page_script(REPORT, &[]);
    laid_out(&embedded(document), "", &LivePage { policy: POLICY, nonce: "", style: "", markup: "", script: &script })
}

/// A page of charts on any subject, in the style of the report: `script` finds the document in the element `data` and may import
/// the modules of the report and `more`; `title` is markup and is not escaped.
pub fn chart_page_html(title: &str, script: Module, more: &[Module], document: &Value) -> String {
    let (data, head, script) = (embedded(document), page_script(HEAD, &[]), page_script(script, more));
    let parts = [
        ("POLICY", POLICY),
        ("TITLE", title),
        ("HEAD", &head),
        ("STYLE", STYLE),
        ("NOTICE", NOTICE),
        ("DATA", &data),
        ("CHARTS", CHARTS),
        ("SCRIPT", &script),
    ];
    filled(CHART_PAGE, &parts)
}

fn embedded(document: &Value) -> String {
    document.to_string().replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

/// The page of a report without its document, for a program that supplies documents; holds the additions to a report.
pub struct LivePage<'a> {
    /// The content security policy.
    pub policy: &'a str,
    /// The nonce of the scripts that the policy allows; empty if it allows all scripts of the page.
    pub nonce: &'a str,
    /// Additional style sheet.
    pub style: &'a str,
    /// Markup before the verdict.
    pub markup: &'a str,
    /// The script, by [`page_script`], which lays out documents by `render` of `render.js`.
    pub script: &'a str,
}

impl LivePage<'_> {
    /// Returns the page.
    pub fn html(&self) -> String {
        // A browser asks the server for an icon that the page does not carry.
        let icon = format!("<link rel=\"icon\" href=\"data:image/svg+xml;base64,{}\">\n", STANDARD.encode(ICON));
        laid_out("null", &icon, self)
    }
}

/// The script of a page: a module with what it imports of the report's modules and of `more`.
pub fn page_script(entry: Module, more: &[Module]) -> String {
    linked_or_told(entry, &[MODULES, more])
}

/// The scripts of a live page as its policy names them, by hash: for a page that is not served, and so has no nonce.
pub fn script_sources(script: &str) -> String {
    let all = [&page_script(HEAD, &[]), CHARTS, script];
    all.map(|text| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text)))).join(" ")
}

fn laid_out(data: &str, icon: &str, live: &LivePage<'_>) -> String {
    let head = page_script(HEAD, &[]);
    let nonce = if live.nonce.is_empty() { String::new() } else { format!(" nonce=\"{}\"", live.nonce) };
    let parts = [
        ("POLICY", live.policy),
        ("ICON", icon),
        ("HEAD", &head),
        ("STYLE", STYLE),
        ("LIVE_STYLE", live.style),
        ("LIVE", live.markup),
        ("NONCE", &nonce),
        ("NOTICE", NOTICE),
        ("DATA", data),
        ("CHARTS", CHARTS),
        ("SCRIPT", live.script),
    ];
    filled(PAGE, &parts)
}

/// Fills in the placeholders of a template.
fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut out = String::with_capacity(template.len() + parts.iter().map(|(_, text)| text.len()).sum::<usize>());
    // Scans left to right: inserted text is not scanned again.
    let mut rest = template;
    while let Some((before, after)) = rest.split_once("{{") {
        out.push_str(before);
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        out.push_str(parts.iter().find(|(n, _)| *n == name).map_or("", |(_, text)| text));
        rest = after;
    }
    out.push_str(rest);
    out
}

#[cfg(test)]
mod tests {
    use super::super::script::linked;
    use super::*;
    use serde_json::json;

    #[test]
    fn every_part_is_in_its_place_and_none_ends_another() {
        let hostile = "</script><script>alert(1)</script><!-- {{SCRIPT}}";
        let page = page_html(&json!({"title": hostile, "verdict": {"headline": ""}}));
        assert!(!page.contains("<script>alert") && page.contains("\\u003c/script\\u003e"));
        let [head, script] = [HEAD, REPORT].map(|entry| linked(entry, &[MODULES]).expect("modules that fit together"));
        for part in [&head, STYLE, &script, CHARTS] {
            assert_eq!(page.matches(part).count(), 1);
            assert!(!part.contains("</script") && !part.contains("</style") && !part.contains("<!--"));
        }
        let data = page.split_once(r#"id="data">"#).and_then(|(_, rest)| rest.split_once("</script>")).expect("the data").0;
        let read: Value = serde_json::from_str(data).expect("JSON");
        assert_eq!(read["title"], hostile);
    }
}
