//! Every reader of calibench, fed by libFuzzer: no input may make it panic, hang or take memory without bound.
//!
//! `tests/fuzz/run` builds it and feeds one reader after the other; `CALIBENCH_FUZZ_READER` names the one to feed.
#![no_main]

mod readers;

use std::sync::LazyLock;

use libfuzzer_sys::fuzz_target;

use readers::{READERS, Reader};

static READER: LazyLock<&Reader> = LazyLock::new(|| {
    let name = std::env::var("CALIBENCH_FUZZ_READER").unwrap_or_default();
    let names: Vec<&str> = READERS.iter().map(|r| r.name).collect();
    READERS.iter().find(|r| r.name == name).unwrap_or_else(|| panic!("CALIBENCH_FUZZ_READER is one of {}", names.join(" ")))
});

fuzz_target!(|bytes: &[u8]| (READER.feed)(bytes));
