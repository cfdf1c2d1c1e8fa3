//! The gallery of signatures: what each effect looks like in the residuals, as pictures and pages.

mod drawing;
mod entry;
mod index;
mod link;
mod plot;
mod scene;
mod see;
mod ticks;
mod variable;

pub use entry::{Entry, Imitator};
pub use index::GALLERY_MARK;
pub use link::gallery_page;
pub use plot::Plot;
pub use see::{Seen, see};

use index::{first_look_page, index_page};

/// Everything that a gallery says beside its entries.
pub struct Gallery {
    /// The entries, in the order of the catalogue.
    pub entries: Vec<Entry>,
    /// The robot and the campaign in a clause, such as "kr6_r700, 200 samples".
    pub campaign: String,
    /// Families that the data cannot show, and what they lack.
    pub untestable: Vec<(String, String)>,
    /// The command that wrote it.
    pub command: String,
}

impl Gallery {
    /// The files of the gallery: names and contents. The first marks the folder.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![(GALLERY_MARK.to_owned(), first_look_page(self)), ("README.md".to_owned(), index_page(self))];
        for entry in &self.entries {
            files.push((format!("{}.md", entry.family), entry.page()));
            files.push((format!("{}.svg", entry.family), entry.seen.plot.svg()));
            if let Some(beside) = &entry.beside {
                files.push((format!("{}-beside.svg", entry.family), beside.plot.svg()));
            }
        }
        files
    }
}
