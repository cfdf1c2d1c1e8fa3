//! MCAP files, from their beginning to their end: no index is needed, and a recording that was cut off is read as far as it goes.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use calibench::files::{FileError, cannot_be_read};
use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, parse_record};

use crate::decoder::{Content, Decoder};
use crate::joints::WRITTEN;
use crate::log::Log;

/// Largest record that is read, bytes: longer ones than this are no chunks of a recording.
const LARGEST_RECORD: usize = 1 << 30;
/// Seconds of a nanosecond.
pub(crate) const NANOSECOND: f64 = 1e-9;
/// Titles of a point, and of a pose.
const TITLES: [&str; 7] = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"];

/// Puts what one message states into the log, or notes why it cannot be read.
pub(crate) fn take(log: &mut Log, topic: &str, decoder: &Decoder, bytes: &[u8], recorded_s: f64) -> Result<(), String> {
    for stated in decoder.read(bytes)? {
        let time = stated.time.unwrap_or(recorded_s);
        match stated.content {
            Content::Joints(names, positions) => log.push_joints(topic, names, time, recorded_s, &positions),
            // A marker that was not found is written as zeros.
            Content::Place(_, [0.0, 0.0, 0.0], _) => {}
            Content::Place(label, at, turn) => {
                let name = if label.is_empty() { topic.to_owned() } else { format!("{topic} {label}") };
                // An orientation of length zero was not filled in.
                match turn.filter(|turn| turn.iter().any(|v| *v != 0.0)) {
                    Some([x, y, z, w]) => {
                        let values = [at[0], at[1], at[2], x, y, z, w];
                        log.push_place(&name, &TITLES, time, recorded_s, &values);
                    }
                    None => log.push_place(&name, &TITLES[..3], time, recorded_s, &at),
                }
            }
        }
    }
    Ok(())
}

/// What is said of messages that cannot be read.
pub(crate) fn not_read(path: &Path, topic: &str, count: usize) -> String {
    let what = if count == 1 { "message cannot be read and is not used" } else { "messages cannot be read and are not used" };
    format!("{}: {topic}: {count} {what}", path.display())
}

/// A topic of the file.
struct Topic {
    name: String,
    decoder: Option<Decoder>,
    /// Messages that could not be read.
    broken: usize,
}

struct Reader<'a> {
    path: &'a Path,
    schemas: HashMap<u16, (String, String, Vec<u8>)>,
    topics: HashMap<u16, Topic>,
    log: Log,
}

/// Bytes before the content of a record: its kind and its length.
const FRAME: usize = 9;

/// Reads the topics of joints and places of an MCAP file.
pub(crate) fn read(path: &Path, mut file: impl Read + Seek) -> Result<Log, FileError> {
    let unreadable = |e| cannot_be_read(path, e);
    let mut magic = [0; MAGIC.len()];
    if file.read_exact(&mut magic).is_err() || magic != *MAGIC {
        return Err(FileError::whole(path, "is no MCAP file", "give a recording that begins as one"));
    }
    let length = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
    let mut at = file.seek(SeekFrom::Start(MAGIC.len() as u64)).map_err(unreadable)?;
    let mut input = BufReader::new(file);
    let mut reader = Reader { path, schemas: HashMap::new(), topics: HashMap::new(), log: Log::default() };
    let mut cut = true;
    while at + FRAME as u64 <= length {
        let mut frame = [0; FRAME];
        input.read_exact(&mut frame).map_err(unreadable)?;
        let (kind, size) = framed(&frame);
        at += FRAME as u64;
        if kind == op::FOOTER {
            cut = false;
            break;
        }
        // A length that lies is no reason to ask for memory that the file cannot fill.
        if size > length - at {
            break;
        }
        at += size;
        if READ.contains(&kind) && size <= LARGEST_RECORD as u64 {
            let mut content = vec![0; usize::try_from(size).unwrap_or_default()];
            input.read_exact(&mut content).map_err(unreadable)?;
            reader.record(parsed(path, kind, &content)?)?;
        } else {
            input.seek_relative(i64::try_from(size).unwrap_or(i64::MAX)).map_err(unreadable)?;
        }
    }
    let mut log = reader.finish();
    if cut {
        log.remarks.push(format!("{}: the recording was cut off; what is before is used", path.display()));
    }
    Ok(log)
}

/// Kinds of records that are read: the others are indices and attachments.
const READ: [u8; 4] = [op::SCHEMA, op::CHANNEL, op::MESSAGE, op::CHUNK];

/// Kind and length of a record.
fn framed(frame: &[u8; FRAME]) -> (u8, u64) {
    let [kind, length @ ..] = *frame;
    (kind, u64::from_le_bytes(length))
}

/// A record of these bytes.
fn parsed<'a>(path: &Path, kind: u8, content: &'a [u8]) -> Result<Record<'a>, FileError> {
    parse_record(kind, content).map_err(|e| broken(path, &format!("record: {e}")))
}

fn broken(path: &Path, what: &str) -> FileError {
    FileError::whole(path, format!("holds a broken {what}"), "record it again, or repair it with `mcap recover`")
}

impl Reader<'_> {
    fn record(&mut self, record: Record<'_>) -> Result<(), FileError> {
        match record {
            Record::Schema { header, data } => {
                self.schemas.insert(header.id, (header.name, header.encoding, data.into_owned()));
            }
            Record::Channel(channel) => {
                let schema = self.schemas.get(&channel.schema_id);
                let (type_name, encoding) = schema.map_or(("", ""), |(name, encoding, _)| (name, encoding));
                let text = schema.filter(|_| encoding == "ros2msg").and_then(|(.., data)| std::str::from_utf8(data).ok());
                let is_cdr = channel.message_encoding == "cdr";
                let decoder = if is_cdr { Decoder::new(type_name, text) } else { None };
                if decoder.is_none() {
                    let why = if is_cdr { String::new() } else { format!("{WRITTEN}{}", channel.message_encoding) };
                    self.log.other.push(format!("{} ({type_name}{why})", channel.topic));
                }
                // Every chunk may state its channels again.
                self.topics.entry(channel.id).or_insert(Topic { name: channel.topic, decoder, broken: 0 });
            }
            Record::Message { header, data } => {
                let Some(topic) = self.topics.get_mut(&header.channel_id) else { return Ok(()) };
                let Some(decoder) = &topic.decoder else { return Ok(()) };
                let recorded = header.log_time as f64 * NANOSECOND;
                if take(&mut self.log, &topic.name, decoder, &data, recorded).is_err() {
                    topic.broken += 1;
                }
            }
            Record::Chunk { header, data } => self.chunk(&header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn chunk(&mut self, header: &ChunkHeader, data: &[u8]) -> Result<(), FileError> {
        let plain = unpacked(self.path, header, data)?;
        let mut rest: &[u8] = &plain;
        while let Some((frame, content)) = rest.split_first_chunk() {
            let (kind, size) = framed(frame);
            let size = usize::try_from(size).unwrap_or(usize::MAX);
            let Some((content, next)) = content.split_at_checked(size) else {
                return Err(broken(self.path, "chunk: a record is longer than the chunk"));
            };
            // No chunk holds another.
            if READ.contains(&kind) && kind != op::CHUNK {
                self.record(parsed(self.path, kind, content)?)?;
            }
            rest = next;
        }
        Ok(())
    }

    fn finish(self) -> Log {
        let Reader { path, topics, mut log, .. } = self;
        let mut broken: Vec<&Topic> = topics.values().filter(|topic| topic.broken > 0).collect();
        broken.sort_by(|a, b| a.name.cmp(&b.name));
        log.remarks.extend(broken.iter().map(|topic| not_read(path, &topic.name, topic.broken)));
        log.other.sort();
        log.other.dedup();
        log
    }
}

/// The records of a chunk.
fn unpacked<'a>(path: &Path, header: &ChunkHeader, data: &'a [u8]) -> Result<Cow<'a, [u8]>, FileError> {
    let limit = header.uncompressed_size.min(LARGEST_RECORD as u64);
    let plain = match header.compression.as_str() {
        "" => return Ok(Cow::Borrowed(data)),
        "lz4" => all_of(lz4_flex::frame::FrameDecoder::new(data), limit),
        "zstd" => unzstd(data, limit),
        other => {
            let remedy = "write it with `zstd`, `lz4` or no compression";
            return Err(FileError::whole(path, format!("has chunks packed by '{other}'"), remedy));
        }
    };
    plain.map(Cow::Owned).map_err(|reason| broken(path, &format!("chunk: {reason}")))
}

/// What is packed by Zstandard, up to so many bytes.
pub(crate) fn unzstd(data: &[u8], limit: u64) -> Result<Vec<u8>, String> {
    all_of(ruzstd::decoding::StreamingDecoder::new(data).map_err(|e| e.to_string())?, limit)
}

fn all_of(unpacked: impl Read, limit: u64) -> Result<Vec<u8>, String> {
    let mut plain = Vec::new();
    unpacked.take(limit).read_to_end(&mut plain).map_err(|e| e.to_string())?;
    Ok(plain)
}
