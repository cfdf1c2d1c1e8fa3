//! docs/figures.md lists the figures as the program has them, and the glossary calls them so. `CALIBENCH_WRITE_SCHEMAS=1` writes
//! the page again.

use std::fs;

use calibench_report::{FIGURES, figures_table};

use crate::schemas_are_written_down::{is_text_of, repository};

/// Text of the page before its table.
const HEAD: &str = "# The figures

Every figure by which a calibration is judged has one name on all screens and in all documents, and one function that computes it.
Lengths are in millimetres; a band in brackets holds the figure in 80 of 100 cases.
Where an expected and a measured figure stand side by side and differ beyond their bands, a sentence says why.
The same terms among all others: [glossary](glossary.md).

";

#[test]
fn the_page_of_figures_is_that_of_the_program() {
    is_text_of(&repository().join("docs/figures.md"), &format!("{HEAD}{}", figures_table()));
}

#[test]
fn the_glossary_calls_them_as_the_screens_do() {
    let glossary = fs::read_to_string(repository().join("docs/glossary.md")).unwrap();
    let (_, section) = glossary.split_once("## The figures").unwrap();
    let section = section.split("\n## ").next().unwrap();
    for figure in FIGURES {
        assert!(section.contains(&format!("\n| {} |", figure.name)), "{} is not in the glossary", figure.name);
    }
    // Names of an earlier day, each a second name for one of the figures.
    for other in ["position error |", "cross-validated error |", "expected error over the workspace |", "| residual |"] {
        assert!(!section.contains(other), "{other}");
    }
}
