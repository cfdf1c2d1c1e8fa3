//! The state message that the controller sends ten times a second on its primary and secondary interface.
//!
//! ```text
//! message : size i32 | type u8 = 16 | parts      big-endian; sizes count all bytes of the message or part
//! part    : size i32 | type u8 | body            4: tool in the base and in the flange: x y z rx ry rz, twice, f64
//! ```

use super::Datum;
use super::data::DataType;

/// Type of the state message.
const ROBOT_STATE: u8 = 16;
/// Type of its part with the tool.
const CARTESIAN_INFO: u8 = 4;
/// Bytes of a size and a type.
const HEADER: usize = 5;
/// Longest message accepted, bytes: real ones have about 1,500.
const LONGEST_MESSAGE: usize = 65_536;

/// The tool, m and rotation vector in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CartesianInfo {
    /// The tool in the base.
    pub base_from_tool: [f64; 6],
    /// The tool in the flange.
    pub flange_from_tool: [f64; 6],
}

impl CartesianInfo {
    /// A state message with this part alone.
    pub fn encode(&self) -> Vec<u8> {
        let mut body = Vec::new();
        for pose in [self.base_from_tool, self.flange_from_tool] {
            Datum::Reals(pose.to_vec()).encode(DataType::Vector6d, &mut body);
        }
        with_header(ROBOT_STATE, &with_header(CARTESIAN_INFO, &body))
    }
}

fn with_header(kind: u8, body: &[u8]) -> Vec<u8> {
    let mut bytes = ((HEADER + body.len()) as u32).to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend_from_slice(body);
    bytes
}

/// Finds the tool among the messages of the interface, in whatever pieces they arrive.
#[derive(Debug, Default)]
pub struct StateMessageReader {
    bytes: Vec<u8>,
}

impl StateMessageReader {
    /// Takes the bytes received; returns the last tool in them, if any. Bytes that are not of this protocol are dropped.
    pub fn push(&mut self, bytes: &[u8]) -> Option<CartesianInfo> {
        self.bytes.extend_from_slice(bytes);
        let mut last = None;
        while let Some(size) = size_of(&self.bytes) {
            if !(HEADER..=LONGEST_MESSAGE).contains(&size) {
                self.bytes.clear();
                break;
            }
            if self.bytes.len() < size {
                break;
            }
            let message: Vec<u8> = self.bytes.drain(..size).collect();
            last = tool_of(&message).or(last);
        }
        last
    }
}

fn size_of(bytes: &[u8]) -> Option<usize> {
    let size: [u8; 4] = bytes.get(..4)?.try_into().ok()?;
    usize::try_from(u32::from_be_bytes(size)).ok()
}

fn tool_of(message: &[u8]) -> Option<CartesianInfo> {
    let mut rest = message.get(HEADER..).filter(|_| message.get(4) == Some(&ROBOT_STATE))?;
    loop {
        let part = rest.get(..size_of(rest)?).filter(|part| part.len() >= HEADER)?;
        rest = &rest[part.len()..];
        if part[4] == CARTESIAN_INFO {
            let mut body = &part[HEADER..];
            let base_from_tool = Datum::decode(DataType::Vector6d, &mut body)?.six();
            let flange_from_tool = Datum::decode(DataType::Vector6d, &mut body)?.six();
            return Some(CartesianInfo { base_from_tool, flange_from_tool });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tool_is_found_among_other_parts_and_messages() {
        let tool =
            CartesianInfo { base_from_tool: [0.1, 0.2, 0.3, 0.0, 3.1, 0.0], flange_from_tool: [0.0, 0.0, 0.12, 0.0, 0.0, 0.5] };
        let encoded = tool.encode();
        let other_part = with_header(1, &[0; 251]);
        let mut parts = other_part.clone();
        parts.extend_from_slice(&encoded[HEADER..]);
        let mut bytes = with_header(20, &[1, 2, 3]);
        bytes.extend(with_header(ROBOT_STATE, &parts));
        let mut reader = StateMessageReader::default();
        let seen: Vec<CartesianInfo> = bytes.chunks(7).filter_map(|piece| reader.push(piece)).collect();
        assert_eq!(seen, [tool]);
        assert_eq!(reader.push(b"GET / HTTP/1.1"), None);
        assert_eq!(reader.push(&encoded), Some(tool));
        assert_eq!(StateMessageReader::default().push(&with_header(ROBOT_STATE, &[0, 0, 0, 0, 0, 0, 0])), None);
    }
}
