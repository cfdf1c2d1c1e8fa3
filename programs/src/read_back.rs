//! A rewritten program is read again: it holds the same positions, at the targets that were written.

use super::rewritten::RewrittenProgram;
use super::scan::{Position, Scan};

/// A rewritten program before it is read again.
pub(super) struct Draft {
    pub program: RewrittenProgram,
    /// The positions of the old text.
    pub positions: Vec<Position>,
    /// The indices of those that were rewritten.
    pub written: Vec<usize>,
}

impl Draft {
    /// The line of the first position that the new text does not hold as it was written; `None` if it holds all.
    pub fn lost(&self, read: &Scan) -> Option<usize> {
        let mut written = self.written.iter().zip(&self.program.rewritten).peekable();
        for (k, old) in self.positions.iter().enumerate() {
            let one = written.next_if(|(index, _)| **index == k);
            let same = |new: &&Position| new.line == old.line && new.name == old.name && new.layout == old.layout;
            let holds = read.positions.get(k).filter(same).is_some_and(|new| match one {
                Some((_, one)) => old.texts(&one.fake).iter().map(|text| text.parse().ok()).eq(values(new).map(Some)),
                None => values(old).eq(values(new)),
            });
            if !holds {
                return Some(old.line);
            }
        }
        (read.positions.len() + read.left.len() + read.unread != self.program.positions).then_some(1)
    }

    /// The program as it was.
    pub fn withdrawn(self, bytes: &[u8], line: usize) -> RewrittenProgram {
        let mut program = RewrittenProgram { bytes: bytes.to_vec(), rewritten: Vec::new(), ..self.program };
        program.refuse(
            line,
            "the whole program",
            "with other numbers it would not be read as it was written, so nothing of it is rewritten",
            "write this line as the controller's editor writes it",
        );
        program
    }
}

fn values(position: &Position) -> impl Iterator<Item = f64> {
    position.numbers.iter().map(|n| n.value)
}
