//! The index of the gallery, and the page on what to look at first.

use std::fmt::Write;

use calibench::effects::registry::Registry;
use calibench::residuals::Look;

use super::Gallery;
use super::entry::{Entry, lower};
use crate::effect_names::capital;

/// The file that marks a folder as a gallery: the page on what to look at first.
pub const GALLERY_MARK: &str = "first-look.md";

fn met(gallery: &Gallery, look: Look) -> Vec<&Entry> {
    gallery.entries.iter().filter(|e| Registry::catalogue().family(&e.effect).is_some_and(|f| Look::of(f) == look)).collect()
}

/// The index: every picture, in the order in which a mechanic would look.
pub(super) fn index_page(gallery: &Gallery) -> String {
    let mut out = format!(
        "# Gallery of signatures\n\n\
         What each effect of the catalogue looks like in the residuals of a fit that lacks it.\n\
         Each was injected alone into {}, with the noise of its instruments; the model was fitted without it, and the picture is the view in which its curve shows most of it.\n\
         The pages say what imitates an effect, which measurement distinguishes the two, and where to look on the machine.\n\n\
         The pictures stand in the order of [what to look at first](first-look.md).\n\n\
         `{}` wrote this folder; `calibench effects gallery DATASET -o DIR` writes one with your own postures and noise.\n",
        gallery.campaign, gallery.command
    );
    for look in Look::ALL {
        let entries = met(gallery, look);
        if entries.is_empty() {
            continue;
        }
        _ = writeln!(out, "\n## {}. {}\n\n| picture | effect |\n|---|---|", look as usize + 1, look.picture());
        for e in entries {
            let Some(f) = Registry::catalogue().family(&e.effect) else { continue };
            let id = f.id;
            _ = writeln!(
                out,
                "| [![{}]({id}.svg)]({id}.md) | [{}]({id}.md), `{id}{}`: {} |",
                capital(f.what),
                capital(f.what),
                f.arguments,
                lower(f.signature.looks[0]).trim_end_matches('.')
            );
        }
    }
    if !gallery.untestable.is_empty() {
        out.push_str("\n## Not in these data\n\n| effect | what they lack |\n|---|---|\n");
        for (id, needs) in &gallery.untestable {
            _ = writeln!(
                out,
                "| {}, `{id}` | {needs} |",
                Registry::catalogue().family(id).map_or(String::new(), |f| capital(f.what))
            );
        }
    }
    out
}

/// The page on the order.
pub(super) fn first_look_page(gallery: &Gallery) -> String {
    let mut out = String::from(
        "# What to look at first\n\n\
         A mechanic looks first at what would make every later picture misleading, then at what is cheap to repair, and last at what only a search can find.\n\
         This is that order, and what is ruled out when a picture shows nothing.\n\n\
         The program keeps to it:\n\n\
         * `calibench diagnose` excludes samples that disagree with all others before anything else, and says so first.\n\
         * `calibench compare`, and the section *Residuals from every side* of the [report](../report.md), list what is significant by the share that it explains; where the strongest is not the one that comes first below, the sentence \"Look first at ...\" names that one.\n\
         * The key residual plot, at the head of the report, is a different question: it shows the one effect that explains most.\n",
    );
    for look in Look::ALL {
        _ = writeln!(
            out,
            "\n## {}. {}\n\n{}\nWhat it rules out: {}.",
            look as usize + 1,
            look.picture(),
            look.because(),
            look.rules_out()
        );
        let entries = met(gallery, look);
        if !entries.is_empty() {
            let links: Vec<String> = entries
                .iter()
                .filter_map(|e| Registry::catalogue().family(&e.effect))
                .map(|f| format!("[{}]({}.md)", f.what, f.id))
                .collect();
            _ = writeln!(out, "\nIt shows: {}.", links.join("; "));
        }
    }
    out.push_str(
        "\n## What remains\n\n\
         If no picture shows anything and the residual still exceeds the noise, many small effects remain, or one of two variables at once.\n\
         `calibench diagnose` then says so, and [the ladder](../hunting-a-missing-effect.md) adds what predicts better, by name or as a curve.\n",
    );
    out
}
