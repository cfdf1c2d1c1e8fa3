//! Calls between the page and this module: numbers only, and bytes in two buffers that the page reads and writes.
//!
//! `room(n)` makes a buffer of n bytes, which the page fills; `put`, `ask` and `take` say what is in it. An answer is read from
//! the other buffer. Everything else is safe Rust, so no binding generator is needed.
#![allow(unsafe_code)]

use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

use calibench::files::memory;
use calibench::prediction::posterior::help;
use calibench::prediction::worker::Worker;
use serde_json::json;

use crate::{Host, Session, warm_up};

/// Buffer for input from the page and for answers to it.
static ROOM: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static ANSWER: Mutex<Vec<u8>> = Mutex::new(Vec::new());
static SESSION: Mutex<Option<Session>> = Mutex::new(None);

fn held<T>(it: &Mutex<T>) -> MutexGuard<'_, T> {
    it.lock().unwrap_or_else(PoisonError::into_inner)
}

mod page {
    #[link(wasm_import_module = "page")]
    unsafe extern "C" {
        /// Receives what is being done: a place and a length in memory.
        pub safe fn told(at: *const u8, length: usize);
        /// Receives the reason, before the module stops for good.
        pub safe fn stopped(at: *const u8, length: usize);
        /// 1 if another worker of the page is there to help.
        pub safe fn has_helper() -> i32;
        /// Receives a job for it: a place and a length in memory.
        pub safe fn hand_over(at: *const u8, length: usize);
        /// Suspends the program until the job is done; returns the length of the result, which is in the room, or -1.
        pub safe fn wait_for_helper() -> i32;
    }
}

/// The other worker of the page.
#[derive(Debug)]
struct OtherWorker;

impl Worker for OtherWorker {
    fn is_there(&self) -> bool {
        page::has_helper() == 1
    }

    fn begin(&self, job: &[u8]) {
        page::hand_over(job.as_ptr(), job.len());
    }

    fn result(&self) -> Option<Vec<u8>> {
        (page::wait_for_helper() >= 0).then(|| std::mem::take(&mut *held(&ROOM)))
    }
}

/// All randomness is seeded.
fn no_randomness(_: &mut [u8]) -> Result<(), getrandom::Error> {
    Err(getrandom::Error::UNSUPPORTED)
}

getrandom::register_custom_getrandom!(no_randomness);

/// Says what is being done.
fn tell(line: &str) {
    page::told(line.as_ptr(), line.len());
}

/// The page.
const HOST: Host = Host { tell, worker: Some(&OtherWorker) };

/// Makes room for so many bytes, and returns where.
#[unsafe(no_mangle)]
pub extern "C" fn room(length: usize) -> *mut u8 {
    let mut room = held(&ROOM);
    room.clear();
    room.resize(length, 0);
    room.as_mut_ptr()
}

/// Takes the room as a name of so many bytes and the content of the file of that name.
#[unsafe(no_mangle)]
pub extern "C" fn put(name: usize) {
    let mut room = std::mem::take(&mut *held(&ROOM));
    let content = room.split_off(name.min(room.len()));
    memory::put_file(Path::new(&*String::from_utf8_lossy(&room)), content);
}

/// Forgets all files.
#[unsafe(no_mangle)]
pub extern "C" fn forget() {
    memory::remove(Path::new(""));
}

/// Is called once, before anything else.
#[unsafe(no_mangle)]
pub extern "C" fn begin() {
    std::panic::set_hook(Box::new(|panic| {
        let words = panic.to_string();
        page::stopped(words.as_ptr(), words.len());
    }));
}

/// Makes ready for judgements, by one that is forgotten.
#[unsafe(no_mangle)]
pub extern "C" fn warm() {
    warm_up(HOST.worker);
}

/// Takes the room as a job that another worker handed over; returns the length of the result, or -1 if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn work() -> i32 {
    let job = std::mem::take(&mut *held(&ROOM));
    let Some(result) = help(&job) else { return -1 };
    let mut out = held(&ANSWER);
    *out = result;
    i32::try_from(out.len()).unwrap_or(-1)
}

/// Takes the room as a question of so many bytes and its JSON body; returns the length of the answer, a JSON document.
#[unsafe(no_mangle)]
pub extern "C" fn ask(what: usize) -> usize {
    let room = std::mem::take(&mut *held(&ROOM));
    let (what, body) = room.split_at(what.min(room.len()));
    let answer = {
        let mut session = held(&SESSION);
        session.get_or_insert_with(|| Session::new(HOST)).ask(&String::from_utf8_lossy(what), body)
    };
    let answer = answer.unwrap_or_else(|e| {
        let field = e.field();
        json!({"error": e.to_string(), "field": field, "changed": e.is_of_earlier_model(), "told": e.told()})
    });
    let mut out = held(&ANSWER);
    *out = answer.to_string().into_bytes();
    out.len()
}

/// Takes the room as the name of a file; returns its length, or -1 if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn take() -> i32 {
    let room = std::mem::take(&mut *held(&ROOM));
    let Some(content) = memory::content(Path::new(&*String::from_utf8_lossy(&room))) else { return -1 };
    let mut out = held(&ANSWER);
    *out = content.to_vec();
    i32::try_from(out.len()).unwrap_or(-1)
}

/// Address of the answer.
#[unsafe(no_mangle)]
pub extern "C" fn answer() -> *const u8 {
    held(&ANSWER).as_ptr()
}
