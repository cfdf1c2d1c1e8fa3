//! Detection of lines sent with another frame than the port is set to; the bits that do not fit show which frame.

use super::GaugeReply;

/// Byte passed on by the system in place of one with wrong parity (POSIX termios, `INPCK` without `IGNPAR` and `PARMRK`).
const WRONG_PARITY: u8 = 0;

/// Describes the line and its frame, if a parity bit explains bytes that no indicator sends.
pub(super) fn of_another_frame(line: &[u8]) -> Option<String> {
    seven_bits_in_eight(line).or_else(|| eight_bits_in_seven(line))
}

/// Seven data bits and a parity bit, read as eight data bits: all bytes have the same parity, and are meaningful without that
/// bit.
fn seven_bits_in_eight(line: &[u8]) -> Option<String> {
    let parity = [(0, "7E"), (1, "7O")].into_iter().find(|(odd, _)| line.iter().all(|byte| byte.count_ones() % 2 == *odd));
    let seven: Vec<u8> = line.iter().map(|byte| byte & 0x7f).collect();
    let seven = seven.trim_ascii_end();
    let (_, frame) = parity.filter(|_| line.iter().any(|byte| *byte >= 0x80))?;
    let means_something = !seven.is_empty() && GaugeReply::parse(seven) != GaugeReply::Noise;
    means_something.then(|| format!("{}, with a parity bit: the line is {frame}, not 8N", String::from_utf8_lossy(seven)))
}

/// Eight data bits or another parity, read as seven data bits and a parity bit: the system marks the bytes with wrong parity,
/// and all others have the right one, rarely including the end of the line. A byte disturbed in transmission has neighbours of
/// both kinds.
fn eight_bits_in_seven(line: &[u8]) -> Option<String> {
    let (wrong, right): (Vec<u8>, Vec<u8>) = line.iter().partition(|byte| **byte == WRONG_PARITY);
    let is_text = right.iter().all(|byte| matches!(byte, 0x20..0x7f | b'\r' | b'\n'));
    let alike = right.windows(2).all(|pair| (pair[0].count_ones() + pair[1].count_ones()) % 2 == 0);
    (!wrong.is_empty() && is_text && alike).then(|| {
        let shown = String::from_utf8_lossy(line).trim_end_matches(['\r', '\n']).replace('\0', "?");
        let of_all = format!("{} of {} bytes with a wrong parity bit", wrong.len(), line.len());
        let frame = if right.is_empty() { "the line has another parity" } else { "the line is 8N, not 7E or 7O" };
        format!("{shown}, {of_all}: {frame}")
    })
}
