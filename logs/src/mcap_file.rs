//! MCAP files, from their beginning to their end: no index is needed, and a recording that was cut off is read as far as it goes.

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::{Read, Seek, SeekFrom};
use std::path::Path;

use calibench::files::{FileError, cannot_be_read};
use mcap::read::ChunkReader;
use mcap::records::{ChunkHeader, Record};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{MAGIC, McapError, parse_record};

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

/// Reads the topics of joints and places of an MCAP file.
pub(crate) fn read(path: &Path, mut file: impl Read + Seek) -> Result<Log, FileError> {
    let options = LinearReaderOptions::default()
        .with_emit_chunks(true)
        .with_skip_end_magic(true)
        .with_record_length_limit(LARGEST_RECORD);
    let mut records = LinearReader::new_with_options(options);
    let mut reader = Reader { path, schemas: HashMap::new(), topics: HashMap::new(), log: Log::default() };
    let broken = |problem: String| FileError::whole(path, problem, "record it again, or repair it with `mcap recover`");
    let mut magic = [0; MAGIC.len()];
    if file.read_exact(&mut magic).is_err() || magic != *MAGIC {
        return Err(FileError::whole(path, "is no MCAP file", "give a recording that begins as one"));
    }
    let length =
        file.seek(SeekFrom::End(0)).and_then(|end| file.rewind().map(|()| end)).map_err(|e| cannot_be_read(path, e))?;
    let mut at = 0;
    let mut cut = false;
    while let Some(event) = records.next_event() {
        match event {
            Ok(LinearReadEvent::ReadRequest(need)) => {
                // A length that lies is no reason to ask for memory that the file cannot fill.
                let rest = usize::try_from(length - at).unwrap_or(usize::MAX);
                let count = file.read(records.insert(need.min(rest.max(1)))).map_err(|e| cannot_be_read(path, e))?;
                at += count as u64;
                records.notify_read(count);
            }
            Ok(LinearReadEvent::Record { data, opcode }) => {
                let record = parse_record(opcode, data).map_err(|e| broken(format!("holds a broken record: {e}")))?;
                reader.record(record)?;
            }
            Err(McapError::UnexpectedEof) if at == length && length > 0 => {
                cut = true;
                break;
            }
            Err(error) => return Err(broken(format!("cannot be read on: {error}"))),
        }
    }
    let mut log = reader.finish();
    if cut {
        log.remarks.push(format!("{}: the recording was cut off; what is before is used", path.display()));
    }
    Ok(log)
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
            Record::Chunk { header, data } => self.chunk(header, &data)?,
            _ => {}
        }
        Ok(())
    }

    fn chunk(&mut self, header: ChunkHeader, data: &[u8]) -> Result<(), FileError> {
        let broken =
            |problem: String| FileError::whole(self.path, problem, "record it again, or repair it with `mcap recover`");
        let plain = unpacked(self.path, &header, data)?;
        let size = plain.len() as u64;
        let header = ChunkHeader { compression: String::new(), uncompressed_size: size, compressed_size: size, ..header };
        let records = ChunkReader::new(header, &plain).map_err(|e| broken(format!("holds a broken chunk: {e}")))?;
        for record in records {
            let record = record.map_err(|e| broken(format!("holds a broken chunk: {e}")))?;
            // No chunk holds another.
            if !matches!(record, Record::Chunk { .. }) {
                self.record(record)?;
            }
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
    let mut plain = Vec::new();
    let read = match header.compression.as_str() {
        "" => return Ok(Cow::Borrowed(data)),
        "lz4" => lz4_flex::frame::FrameDecoder::new(data).take(limit).read_to_end(&mut plain).map_err(|e| e.to_string()),
        "zstd" => unzstd(data, limit).map(|all| {
            plain = all;
            plain.len()
        }),
        other => {
            let remedy = "write it with `zstd`, `lz4` or no compression";
            return Err(FileError::whole(path, format!("has chunks packed by '{other}'"), remedy));
        }
    };
    match read {
        Ok(_) => Ok(Cow::Owned(plain)),
        Err(reason) => {
            let problem = format!("holds a chunk that cannot be unpacked: {reason}");
            Err(FileError::whole(path, problem, "record it again, or repair it with `mcap recover`"))
        }
    }
}

/// What is packed by Zstandard, up to so many bytes.
pub(crate) fn unzstd(data: &[u8], limit: u64) -> Result<Vec<u8>, String> {
    let mut plain = Vec::new();
    let unpacked = ruzstd::decoding::StreamingDecoder::new(data).map_err(|e| e.to_string())?;
    unpacked.take(limit).read_to_end(&mut plain).map_err(|e| e.to_string())?;
    Ok(plain)
}
