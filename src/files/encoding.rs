//! Text in UTF-8 or ISO-8859-1: what is not the one is read as the other.

use std::io::{self, Read};

/// The text of these bytes: each that is not part of a character of UTF-8 is one of ISO-8859-1.
pub(crate) fn in_utf8(bytes: Vec<u8>) -> String {
    String::from_utf8(bytes).unwrap_or_else(|e| {
        let mut text = String::new();
        let mut rest = decode(e.as_bytes(), &mut text);
        rest.drain(..).for_each(|b| text.push(char::from(b)));
        text
    })
}

/// Appends the text of bytes, and returns the last few if more could make them a character.
fn decode(mut bytes: &[u8], text: &mut String) -> Vec<u8> {
    loop {
        let e = match std::str::from_utf8(bytes) {
            Ok(all) => {
                text.push_str(all);
                return Vec::new();
            }
            Err(e) => e,
        };
        let (valid, rest) = bytes.split_at(e.valid_up_to());
        text.push_str(std::str::from_utf8(valid).unwrap_or_default());
        let Some(wrong) = e.error_len() else { return rest.to_vec() };
        text.extend(rest[..wrong].iter().map(|&b| char::from(b)));
        bytes = &rest[wrong..];
    }
}

/// Number of bytes that are read at once.
const CHUNK: usize = 1 << 16;

/// A reader of bytes in UTF-8, of a file that is in UTF-8 or ISO-8859-1.
pub(crate) struct Transcoded<R> {
    inner: R,
    /// Bytes that are read and not yet decoded.
    pending: Vec<u8>,
    text: Vec<u8>,
    /// Number of bytes of the text that were handed on.
    taken: usize,
}

impl<R: Read> Transcoded<R> {
    pub fn new(inner: R) -> Self {
        Transcoded { inner, pending: Vec::new(), text: Vec::new(), taken: 0 }
    }
}

impl<R: Read> Read for Transcoded<R> {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.text.len() {
            let before = self.pending.len();
            self.pending.resize(before + CHUNK, 0);
            let read = self.inner.read(&mut self.pending[before..]);
            self.pending.truncate(before + read.as_ref().map_or(0, |n| *n));
            let ended = read? == 0;
            let mut text = String::new();
            self.pending = decode(&self.pending, &mut text);
            if ended {
                text.extend(self.pending.drain(..).map(char::from));
            }
            (self.text, self.taken) = (text.into_bytes(), 0);
            if ended && self.text.is_empty() {
                return Ok(0);
            }
        }
        let count = to.len().min(self.text.len() - self.taken);
        to[..count].copy_from_slice(&self.text[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hands on one byte at a time, so that characters are cut.
    struct Drops<'a>(&'a [u8]);

    impl Read for Drops<'_> {
        fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
            let Some((first, rest)) = self.0.split_first() else { return Ok(0) };
            (to[0], self.0) = (*first, rest);
            Ok(1)
        }
    }

    #[test]
    fn either_encoding_is_read() {
        for (bytes, text) in [
            (&b"q1 [\xb0]"[..], "q1 [°]"),
            ("q1 [°], ü, 漢".as_bytes(), "q1 [°], ü, 漢"),
            (b"\xfc\xe4;\xc3", "üä;Ã"),
            (b"", ""),
            (b"a\xe2\x82", "aâ\u{82}"),
        ] {
            assert_eq!(in_utf8(bytes.to_vec()), text);
            let mut read = String::new();
            Transcoded::new(Drops(bytes)).read_to_string(&mut read).expect("UTF-8");
            assert_eq!(read, text);
        }
    }
}
