//! The workbench as one file that any browser opens: the program is in it, as WebAssembly, and nothing is asked of anybody.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use calibench::files::FileError;
use calibench::files::disk::read_bytes;

use crate::front::{MARKUP, MODULES, STYLE};
use calibench_report::{LivePage, linked_or_told, script_sources};
use calibench_report::{Module, modules, page_script};

const OWN: &[Module] = modules!("calibench-workbench", "in_browser": "backend.js", "files.js", "understood.js");
/// The script of the page.
const OPENING: Module = Module { name: "calibench-workbench/opening.js", text: include_str!("in_browser/opening.js") };
/// The script of its workers.
const WORKER: Module = Module { name: "calibench-workbench/worker.js", text: include_str!("in_browser/worker.js") };
const OPENING_MARKUP: &str = include_str!("in_browser/opening.html");
const OPENING_STYLE: &str = include_str!("in_browser/opening.css");

/// First bytes of a gzip file (RFC 1952).
const GZIP: &[u8] = &[0x1f, 0x8b];

/// The page with the program of this file: the package `calibench-web` as WebAssembly, packed by gzip.
///
/// The policy of the page allows its own scripts, by their hashes, and no connection.
///
/// # Errors
/// If the file cannot be read, or is not packed.
pub fn page_in_browser(module: &Path) -> Result<String, FileError> {
    let remedy = "`web/build` makes it, with this program's own version";
    let bytes = read_bytes(module).map_err(|e| FileError::whole(module, format!("cannot be read: {e}"), remedy))?;
    if !bytes.starts_with(GZIP) {
        return Err(FileError::whole(module, "is not a gzip file", remedy));
    }
    let script = page_script(OPENING, &[MODULES, OWN].concat());
    let policy = format!(
        "default-src 'none'; script-src {} 'wasm-unsafe-eval'; worker-src blob:; style-src 'unsafe-inline'; img-src data:; connect-src 'none'; base-uri 'none'; form-action 'none'",
        script_sources(&script)
    );
    let data = |id: &str, text: &str| format!("<script type=\"text/plain\" id=\"{id}\">{text}</script>\n");
    let markup =
        [MARKUP, OPENING_MARKUP, &data("worker", &linked_or_told(WORKER, &[])), &data("module", &STANDARD.encode(bytes))]
            .concat();
    let style = [STYLE, OPENING_STYLE].concat();
    Ok(LivePage { policy: &policy, nonce: "", style: &style, markup: &markup, script: &script }.html())
}

#[cfg(test)]
mod tests {
    use super::*;
    use calibench_report::linked;

    #[test]
    fn the_modules_of_its_scripts_fit_together() {
        let script = page_script(OPENING, &[MODULES, OWN].concat());
        assert!(script.contains("function openFiles("), "{script}");
        assert!(linked(WORKER, &[]).is_ok());
    }
}
