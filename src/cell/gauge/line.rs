//! Splitting of the bytes of a serial line into lines.

/// Longest line kept, bytes: the longest answer of any of these instruments, a list of settings, has less than half.
pub const LONGEST_LINE: usize = 120;

/// CR with the parity bit of a line of seven data bits and even parity, as seen by a port set to eight. It ends the
/// line but remains in it, so that no answer is taken from such a line, not even from one whose digits all have a zero parity
/// bit, and the cause can be reported.
const CR_WITH_PARITY: u8 = 0x8d;

/// Finds lines that end with CR, LF or both, however they are fragmented; holds one unfinished line besides the bytes pushed
/// last.
///
/// ```
/// use calibench::cell::gauge::LineReader;
///
/// let mut reader = LineReader::default();
/// reader.push(b"+006.35");
/// assert_eq!(reader.line(), None);
/// reader.push(b"00\r\n+0");
/// assert_eq!(reader.line().as_deref(), Some(&b"+006.3500"[..]));
/// assert!(reader.line().is_none() && reader.is_amid_line());
/// ```
#[derive(Debug, Default)]
pub struct LineReader {
    bytes: Vec<u8>,
    skipping: bool,
}

impl LineReader {
    /// Appends received bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// Returns the next non-empty line, without its end. A line that is too long is truncated: it is not an answer.
    pub fn line(&mut self) -> Option<Vec<u8>> {
        loop {
            match self.bytes.iter().position(|byte| matches!(*byte, b'\r' | b'\n' | CR_WITH_PARITY)) {
                Some(end) => {
                    let mut line: Vec<u8> = self.bytes.drain(..=end).collect();
                    if line[end] != CR_WITH_PARITY {
                        line.truncate(end);
                    }
                    line.truncate(LONGEST_LINE);
                    let rest_of_long = std::mem::take(&mut self.skipping);
                    if !rest_of_long && !line.is_empty() {
                        return Some(line);
                    }
                }
                None if self.skipping => {
                    self.bytes.clear();
                    return None;
                }
                None if self.bytes.len() > LONGEST_LINE => {
                    self.skipping = true;
                    let mut line = std::mem::take(&mut self.bytes);
                    line.truncate(LONGEST_LINE);
                    return Some(line);
                }
                None => return None,
            }
        }
    }

    /// True if a line has begun and not ended.
    pub fn is_amid_line(&self) -> bool {
        !self.bytes.is_empty()
    }

    /// The bytes of an unfinished line.
    pub(super) fn unfinished(&self) -> &[u8] {
        &self.bytes
    }

    /// Discards all bytes not yet taken.
    pub fn clear(&mut self) {
        self.bytes.clear();
        self.skipping = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_found_however_they_are_cut() {
        let mut lines = LineReader::default();
        let mut found = Vec::new();
        for byte in b"+006.3500\r+1\r\n\r\n-2\n3" {
            lines.push(&[*byte]);
            found.extend(lines.line());
        }
        assert_eq!(found, [b"+006.3500".to_vec(), b"+1".to_vec(), b"-2".to_vec()]);
        assert!(lines.is_amid_line());
    }

    #[test]
    fn noise_without_an_end_does_not_grow() {
        let mut lines = LineReader::default();
        for _ in 0..1000 {
            lines.push(&[b'x'; 100]);
            while lines.line().is_some() {}
            assert!(lines.bytes.len() <= LONGEST_LINE);
        }
        lines.push(b"\r+1\r");
        assert_eq!(lines.line(), Some(b"+1".to_vec()));
    }
}
