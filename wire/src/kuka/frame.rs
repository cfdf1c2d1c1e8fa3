//! Wire format between a PC and the variable server on a KUKA controller: KUKAVARPROXY, and C3 Bridge's basic functions.
//!
//! ```text
//! request  : tag u16 | length u16 | function u8 | { length u16 | bytes } once or twice    0 reads name, 1 writes value to name
//! response : tag u16 | length u16 | function u8 | length u16 | value | code u16 | success u8
//! ```
//!
//! Integers are big-endian; the first length counts the bytes after it. Text is one byte per character (Windows-1252 on the
//! controller, of which the names and numbers in use are the ASCII half; the other half is read as Latin-1, so that nothing is
//! lost). Source: the servers' own sources (ImtsSrl/KUKAVARPROXY aa95b90, ulsu-tech/c3bridge-server a392195).

use thiserror::Error;

/// Longest frame accepted, bytes after the length field: twice what KUKAVARPROXY reads at once. A longer one is not this
/// protocol.
pub const LONGEST_FRAME: usize = 4096;

/// Bytes of tag and length.
const HEADER: usize = 4;

/// A client's request.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Call {
    /// Reads the value of a variable (function 0).
    Read {
        /// Name as in KRL, e.g. `$OV_PRO`, `COM_E6POS.X`.
        name: String,
    },
    /// Writes a value to a variable (function 1).
    Write {
        /// Name as in KRL.
        name: String,
        /// Value as in KRL.
        value: String,
    },
    /// A function that this codec does not parse.
    Other {
        /// Its number.
        function: u8,
        /// The bytes after the number.
        body: Vec<u8>,
    },
}

/// A request with the tag that its response will carry.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Request {
    /// Tag, chosen by the client.
    pub tag: u16,
    /// The request itself.
    pub call: Call,
}

/// A response.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Response {
    /// Tag of the request.
    pub tag: u16,
    /// Function of the request.
    pub function: u8,
    /// The value read or written.
    pub value: String,
    /// 1 for success; KUKAVARPROXY also sends it for failures, C3 Bridge sends the failure.
    pub code: u16,
    /// True if the server reports success; KUKAVARPROXY also does so for variables that do not exist, with an empty value.
    pub success: bool,
}

/// Reason why bytes are not a frame.
#[derive(Debug, Error, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum FrameError {
    /// The length is implausible; the start of the next frame is unknown, so the connection is of no further use.
    #[error("a frame of {length} bytes is longer than the {LONGEST_FRAME} of this protocol")]
    TooLong {
        /// Length stated.
        length: usize,
    },
    /// The parts do not fill the frame; the next frame is not affected.
    #[error("the parts of frame {tag} do not fill it")]
    Malformed {
        /// Tag of the frame.
        tag: u16,
    },
}

impl Request {
    /// Encodes the request for the wire.
    ///
    /// # Errors
    /// [`FrameError::TooLong`].
    pub fn encode(&self) -> Result<Vec<u8>, FrameError> {
        let mut body = Vec::new();
        match &self.call {
            Call::Read { name } => {
                body.push(0);
                put_text(&mut body, name);
            }
            Call::Write { name, value } => {
                body.push(1);
                put_text(&mut body, name);
                put_text(&mut body, value);
            }
            Call::Other { function, body: rest } => {
                body.push(*function);
                body.extend_from_slice(rest);
            }
        }
        frame(self.tag, &body)
    }

    /// Decodes the bytes after the length field.
    fn decode(tag: u16, body: &[u8]) -> Result<Self, FrameError> {
        let malformed = FrameError::Malformed { tag };
        let (&function, rest) = body.split_first().ok_or(malformed)?;
        let call = match function {
            0 => {
                let (name, rest) = take_text(rest).ok_or(malformed)?;
                if !rest.is_empty() {
                    return Err(malformed);
                }
                Call::Read { name }
            }
            1 => {
                let (name, rest) = take_text(rest).ok_or(malformed)?;
                let (value, rest) = take_text(rest).ok_or(malformed)?;
                if !rest.is_empty() {
                    return Err(malformed);
                }
                Call::Write { name, value }
            }
            function => Call::Other { function, body: rest.to_vec() },
        };
        Ok(Request { tag, call })
    }
}

impl Response {
    /// Encodes the response for the wire.
    ///
    /// # Errors
    /// [`FrameError::TooLong`].
    pub fn encode(&self) -> Result<Vec<u8>, FrameError> {
        let mut body = vec![self.function];
        put_text(&mut body, &self.value);
        body.extend_from_slice(&self.code.to_be_bytes());
        body.push(u8::from(self.success));
        frame(self.tag, &body)
    }

    /// Decodes the bytes after the length field.
    fn decode(tag: u16, body: &[u8]) -> Result<Self, FrameError> {
        let parts = || {
            let (&function, rest) = body.split_first()?;
            let (value, rest) = take_text(rest)?;
            let &[high, low, success] = rest else { return None };
            Some(Response { tag, function, value, code: u16::from_be_bytes([high, low]), success: success != 0 })
        };
        parts().ok_or(FrameError::Malformed { tag })
    }
}

/// Finds frames in the bytes of a connection, however the network fragments them.
///
/// Holds at most one unfinished frame besides the bytes pushed last, provided that frames are taken until there are none.
#[derive(Debug, Default)]
pub struct FrameReader {
    bytes: Vec<u8>,
    lost: Option<FrameError>,
}

impl FrameReader {
    /// Appends received bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        if self.lost.is_none() {
            self.bytes.extend_from_slice(bytes);
        }
    }

    /// Returns the next request, once it is complete.
    ///
    /// # Errors
    /// [`FrameError::Malformed`] once for that frame; [`FrameError::TooLong`] from then on.
    pub fn request(&mut self) -> Result<Option<Request>, FrameError> {
        self.next(Request::decode)
    }

    /// Returns the next response, once it is complete.
    ///
    /// # Errors
    /// As for requests.
    pub fn response(&mut self) -> Result<Option<Response>, FrameError> {
        self.next(Response::decode)
    }

    /// True if a frame has begun and not ended.
    pub fn is_amid_frame(&self) -> bool {
        !self.bytes.is_empty()
    }

    fn next<T>(&mut self, decode: fn(u16, &[u8]) -> Result<T, FrameError>) -> Result<Option<T>, FrameError> {
        if let Some(lost) = self.lost {
            return Err(lost);
        }
        let &[t1, t0, l1, l0, ..] = self.bytes.as_slice() else { return Ok(None) };
        let length = usize::from(u16::from_be_bytes([l1, l0]));
        if length > LONGEST_FRAME {
            let lost = FrameError::TooLong { length };
            (self.lost, self.bytes) = (Some(lost), Vec::new());
            return Err(lost);
        }
        let Some(body) = self.bytes.get(HEADER..HEADER + length) else { return Ok(None) };
        let decoded = decode(u16::from_be_bytes([t1, t0]), body);
        self.bytes.drain(..HEADER + length);
        decoded.map(Some)
    }
}

fn frame(tag: u16, body: &[u8]) -> Result<Vec<u8>, FrameError> {
    let too_long = FrameError::TooLong { length: body.len() };
    let length = u16::try_from(body.len()).map_err(|_| too_long)?;
    if body.len() > LONGEST_FRAME {
        return Err(too_long);
    }
    Ok([&tag.to_be_bytes(), &length.to_be_bytes(), body].concat())
}

/// Text too long for its length field also makes the frame too long, and that is the error reported.
fn put_text(body: &mut Vec<u8>, text: &str) {
    let bytes: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).unwrap_or(b'?')).collect();
    body.extend_from_slice(&u16::try_from(bytes.len()).unwrap_or(u16::MAX).to_be_bytes());
    body.extend_from_slice(&bytes);
}

fn take_text(body: &[u8]) -> Option<(String, &[u8])> {
    let (length, rest) = body.split_first_chunk::<2>()?;
    let (text, rest) = rest.split_at_checked(usize::from(u16::from_be_bytes(*length)))?;
    Some((text.iter().map(|&byte| char::from(byte)).collect(), rest))
}
