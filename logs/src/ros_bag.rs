//! Bags of ROS 2: a folder with `metadata.yaml`, or its files alone, in SQLite or MCAP, whole or packed by Zstandard.

use std::collections::HashMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

use calibench::files::{FileError, cannot_be_read, read_bytes};
use rusqlite::{Connection, OpenFlags};

use crate::decoder::Decoder;
use crate::log::Log;
use crate::mcap_file::{self, NANOSECOND, not_read, take, unzstd};

/// First bytes of what is packed by Zstandard.
const ZSTD: [u8; 4] = [0x28, 0xb5, 0x2f, 0xfd];
/// Largest unpacked file or message, bytes.
const LARGEST: u64 = 1 << 32;
/// The file that makes a folder a bag.
const METADATA: &str = "metadata.yaml";

/// The files of a bag in their order; `None` if the folder is none.
pub(crate) fn files_of_bag(folder: &Path) -> Option<Vec<PathBuf>> {
    let all = std::fs::read_dir(folder).ok()?.filter_map(Result::ok).map(|entry| entry.path());
    let mut files: Vec<PathBuf> = all.filter(|path| is_recording(path)).collect();
    // `bag_10` follows `bag_9`.
    files.sort_by_key(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        (name.len(), name)
    });
    (folder.join(METADATA).is_file() || !files.is_empty()).then_some(files)
}

/// True of a recording by its name.
pub(crate) fn is_recording(path: &Path) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".zstd").unwrap_or(&name);
    name.ends_with(".mcap") || name.ends_with(".db3")
}

/// Reads one file of a bag.
pub(crate) fn read(path: &Path) -> Result<Log, FileError> {
    let name = path.to_string_lossy().to_lowercase();
    if let Some(name) = name.strip_suffix(".zstd") {
        let unpacked = unzstd(&read_bytes(path)?, LARGEST);
        let plain = unpacked.map_err(|e| FileError::whole(path, format!("cannot be unpacked: {e}"), "record it again"))?;
        let mut file = tempfile::NamedTempFile::new().map_err(|e| cannot_be_read(path, e))?;
        file.write_all(&plain).map_err(|e| cannot_be_read(path, e))?;
        return if name.ends_with(".mcap") { mcap_file::read(path, file) } else { read_sqlite(path, file.path()) };
    }
    if name.ends_with(".mcap") {
        return mcap_file::read(path, File::open(path).map_err(|e| cannot_be_read(path, e))?);
    }
    // SQLite makes what is not there, or says little.
    File::open(path).map_err(|e| cannot_be_read(path, e))?;
    read_sqlite(path, path)
}

fn read_sqlite(named: &Path, path: &Path) -> Result<Log, FileError> {
    let wrong = |e: rusqlite::Error| {
        FileError::whole(named, format!("cannot be read as a bag of ROS 2: {e}"), "give the .db3 file of a rosbag2 recording")
    };
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_NO_MUTEX;
    let bag = Connection::open_with_flags(path, flags).map_err(wrong)?;
    let mut definitions: HashMap<String, String> = HashMap::new();
    // Bags of before ROS 2 Iron carry no definitions.
    if let Ok(mut rows) = bag.prepare("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions") {
        let all = rows.query_map([], |row| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?)));
        let all = all.map_err(wrong)?.filter_map(Result::ok);
        definitions.extend(all.filter(|(_, encoding, _)| encoding == "ros2msg").map(|(name, _, text)| (name, text)));
    }
    let mut log = Log::default();
    let mut topics: HashMap<i64, (String, Decoder, usize)> = HashMap::new();
    let mut rows = bag.prepare("SELECT id, name, type, serialization_format FROM topics").map_err(wrong)?;
    let all = rows.query_map([], |row| {
        Ok((row.get::<_, i64>(0)?, row.get::<_, String>(1)?, row.get::<_, String>(2)?, row.get::<_, String>(3)?))
    });
    for row in all.map_err(wrong)? {
        let (id, topic, type_name, format) = row.map_err(wrong)?;
        let decoder =
            if format == "cdr" { Decoder::new(&type_name, definitions.get(&type_name).map(String::as_str)) } else { None };
        match decoder {
            Some(decoder) => _ = topics.insert(id, (topic, decoder, 0)),
            None => log.other.push(format!("{topic} ({type_name})")),
        }
    }
    let mut ids: Vec<i64> = topics.keys().copied().collect();
    ids.sort_unstable();
    let ids: Vec<String> = ids.iter().map(ToString::to_string).collect();
    let query =
        format!("SELECT topic_id, timestamp, data FROM messages WHERE topic_id IN ({}) ORDER BY timestamp, id", ids.join(", "));
    let mut messages = bag.prepare(&query).map_err(wrong)?;
    let mut rows = messages.query([]).map_err(wrong)?;
    while let Some(row) = rows.next().map_err(wrong)? {
        let id: i64 = row.get(0).map_err(wrong)?;
        let recorded = row.get::<_, i64>(1).map_err(wrong)? as f64 * NANOSECOND;
        let data = row.get_ref(2).map_err(wrong)?.as_blob().unwrap_or_default();
        let Some((topic, decoder, broken)) = topics.get_mut(&id) else { continue };
        let taken = if data.starts_with(&ZSTD) {
            unzstd(data, LARGEST).and_then(|plain| take(&mut log, topic, decoder, &plain, recorded))
        } else {
            take(&mut log, topic, decoder, data, recorded)
        };
        *broken += usize::from(taken.is_err());
    }
    let mut broken: Vec<String> =
        topics.values().filter(|(.., broken)| *broken > 0).map(|(topic, _, broken)| not_read(named, topic, *broken)).collect();
    broken.sort();
    log.remarks.extend(broken);
    Ok(log)
}
