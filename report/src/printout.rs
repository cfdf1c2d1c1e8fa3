//! Text with tables in it, which are drawn when the width of the terminal is known.

use std::fmt;
use std::ops::Add;

use super::tables::Table;

/// A sentence, and whether it belongs to the answer or explains how that came about.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Sentence {
    /// The sentence.
    pub text: String,
    /// True if it belongs to the answer.
    pub is_answer: bool,
}

impl Sentence {
    /// A sentence of the answer.
    pub(super) fn answer(text: impl Into<String>) -> Self {
        Sentence { text: text.into(), is_answer: true }
    }

    /// A sentence that explains.
    pub(super) fn detail(text: impl Into<String>) -> Self {
        Sentence { text: text.into(), is_answer: false }
    }
}

/// The sentences without their weight.
pub(super) fn texts(sentences: Vec<Sentence>) -> Vec<String> {
    sentences.into_iter().map(|sentence| sentence.text).collect()
}

/// A part of a printout.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Block {
    /// Lines of text.
    Text(String),
    /// A table, on lines of its own.
    Table(Table),
}

/// Text with tables in it. As a string, its tables are drawn as wide as their cells.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Printout {
    blocks: Vec<Block>,
}

impl Printout {
    /// The parts, in order; no two texts follow each other.
    #[must_use]
    pub fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    /// Appends text, a table or another printout. Line breaks before and after a table are part of the text.
    pub fn push(&mut self, part: impl Into<Printout>) {
        for block in part.into().blocks {
            match (self.blocks.last_mut(), block) {
                (Some(Block::Text(text)), Block::Text(more)) => text.push_str(&more),
                (_, block) => self.blocks.push(block),
            }
        }
    }
}

impl<T: Into<Printout>> Add<T> for Printout {
    type Output = Printout;

    fn add(mut self, part: T) -> Printout {
        self.push(part);
        self
    }
}

impl fmt::Display for Printout {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.blocks.iter().try_for_each(|block| match block {
            Block::Text(text) => f.write_str(text),
            Block::Table(table) => table.fmt(f),
        })
    }
}

impl From<String> for Printout {
    fn from(text: String) -> Self {
        Printout { blocks: vec![Block::Text(text)] }
    }
}

impl From<&String> for Printout {
    fn from(text: &String) -> Self {
        text.clone().into()
    }
}

impl From<&str> for Printout {
    fn from(text: &str) -> Self {
        text.to_owned().into()
    }
}

impl From<Table> for Printout {
    fn from(table: Table) -> Self {
        Printout { blocks: vec![Block::Table(table)] }
    }
}
