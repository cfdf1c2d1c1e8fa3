//! Packages of RTDE, protocol version 2.
//!
//! ```text
//! package : size u16 | type u8 | body            big-endian; the size counts all bytes of the package
//! V  version u16                  -> accepted u8
//! v                               -> major, minor, bugfix, build u32
//! O  frequency f64, names         -> recipe u8, types        names and types are separated by commas
//! I  names                        -> recipe u8, types        a type may be IN_USE or NOT_FOUND
//! S, P                            -> accepted u8             start, pause
//! U  recipe u8, values            in either direction, unacknowledged
//! M  length u8, message, length u8, source, level u8         from the controller, at any time
//! ```

use thiserror::Error;

/// Version of the protocol that this codec speaks.
pub(super) const PROTOCOL_VERSION: u16 = 2;

/// Longest package accepted, bytes: all variables at once have about 4,000.
pub const LONGEST_PACKAGE: usize = 16_384;

/// Bytes of size and type.
const HEADER: usize = 3;

/// Types of packages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PackageKind {
    /// Agrees on the version of the protocol.
    ProtocolVersion,
    /// Asks for the version of the controller's software.
    ControllerVersion,
    /// A message in words.
    Message,
    /// Values of a recipe.
    Data,
    /// Chooses the variables that the controller sends.
    Outputs,
    /// Chooses the variables that the client sends.
    Inputs,
    /// Starts the exchange.
    Start,
    /// Pauses it.
    Pause,
}

/// The types with their bytes.
const KINDS: [(PackageKind, u8); 8] = [
    (PackageKind::ProtocolVersion, b'V'),
    (PackageKind::ControllerVersion, b'v'),
    (PackageKind::Message, b'M'),
    (PackageKind::Data, b'U'),
    (PackageKind::Outputs, b'O'),
    (PackageKind::Inputs, b'I'),
    (PackageKind::Start, b'S'),
    (PackageKind::Pause, b'P'),
];

impl PackageKind {
    fn byte(self) -> u8 {
        KINDS.iter().find(|(kind, _)| *kind == self).map_or(0, |(_, byte)| *byte)
    }
}

/// A package.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Package {
    /// Its type.
    pub kind: PackageKind,
    /// The bytes after the type.
    pub body: Vec<u8>,
}

/// Bytes that are not of this protocol.
#[derive(Debug, Error, Clone, PartialEq, Eq)]
pub enum PackageError {
    /// There is no such type.
    #[error("the byte {byte} is not a type of RTDE packages: is this the port of RTDE, 30004?")]
    Kind {
        /// As received.
        byte: u8,
    },
    /// No package has this size.
    #[error("a package of {size} bytes is not one of RTDE: is this the port of RTDE, 30004?")]
    Size {
        /// As received.
        size: usize,
    },
}

impl Package {
    /// The package on the wire; a body that is too long for its size field is cut off.
    pub fn encode(&self) -> Vec<u8> {
        let body = &self.body[..self.body.len().min(LONGEST_PACKAGE - HEADER)];
        let size = (HEADER + body.len()) as u16;
        let mut bytes = size.to_be_bytes().to_vec();
        bytes.push(self.kind.byte());
        bytes.extend_from_slice(body);
        bytes
    }

    /// A message in words: text, source and level (0 exception, 1 error, 2 warning, 3 information).
    pub fn message(text: &str, source: &str, level: u8) -> Self {
        let mut body = Vec::new();
        for part in [text, source] {
            let part = &part.as_bytes()[..part.len().min(usize::from(u8::MAX))];
            body.push(part.len() as u8);
            body.extend_from_slice(part);
        }
        body.push(level);
        Package { kind: PackageKind::Message, body }
    }

    /// The words of a message; `None` if it is not one.
    pub fn words(&self) -> Option<String> {
        let (&length, rest) = self.body.split_first()?;
        let text = rest.get(..usize::from(length))?;
        (self.kind == PackageKind::Message).then(|| String::from_utf8_lossy(text).trim().to_owned())
    }
}

/// Puts packages together from the pieces in which they arrive.
#[derive(Debug, Default)]
pub struct PackageReader {
    bytes: Vec<u8>,
}

impl PackageReader {
    /// Takes the bytes received.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend_from_slice(bytes);
    }

    /// The next complete package, if there is one.
    ///
    /// # Errors
    /// When the bytes are not of this protocol; no further package can then be found.
    pub fn next_package(&mut self) -> Result<Option<Package>, PackageError> {
        let [high, low, byte, ..] = self.bytes[..] else { return Ok(None) };
        let size = usize::from(u16::from_be_bytes([high, low]));
        if !(HEADER..=LONGEST_PACKAGE).contains(&size) {
            return Err(PackageError::Size { size });
        }
        let kind = KINDS.iter().find(|(_, known)| *known == byte).map(|(kind, _)| *kind);
        let kind = kind.ok_or(PackageError::Kind { byte })?;
        if self.bytes.len() < size {
            return Ok(None);
        }
        let package = self.bytes.drain(..size).skip(HEADER).collect();
        Ok(Some(Package { kind, body: package }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packages_arrive_in_any_pieces() {
        let sent = [
            Package { kind: PackageKind::Start, body: vec![] },
            Package { kind: PackageKind::Data, body: vec![1, 2, 3, 4] },
            Package::message("a protective stop", "calibench", 1),
        ];
        let bytes: Vec<u8> = sent.iter().flat_map(Package::encode).collect();
        let mut reader = PackageReader::default();
        let mut seen = Vec::new();
        for byte in bytes {
            reader.push(&[byte]);
            seen.extend(reader.next_package().unwrap());
        }
        assert_eq!(seen, sent);
        assert_eq!(seen[2].words().as_deref(), Some("a protective stop"));
        assert_eq!(seen[1].words(), None);
    }

    #[test]
    fn other_bytes_are_refused() {
        let mut reader = PackageReader::default();
        reader.push(b"GET / HTTP/1.1\r\n");
        assert_eq!(reader.next_package(), Err(PackageError::Size { size: usize::from(u16::from_be_bytes(*b"GE")) }));
        let mut reader = PackageReader::default();
        reader.push(&[0, 3, b'X']);
        assert_eq!(reader.next_package(), Err(PackageError::Kind { byte: b'X' }));
        let mut reader = PackageReader::default();
        reader.push(&[0, 2, b'S']);
        assert_eq!(reader.next_package(), Err(PackageError::Size { size: 2 }));
    }
}
