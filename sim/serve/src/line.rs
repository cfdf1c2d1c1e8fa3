//! The wire of an indicator: takes requests as they arrive, and sends answers as they are or as a fault alters them.

use std::cell::RefCell;
use std::io;
use std::time::Duration;

use calibench::cell::gauge::LineReader;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::time::{sleep, timeout};

use super::fault::Fault;
use super::floor::Floor;
use super::instrument::Instrument;
use calibench_sim::world::READING_S;

/// A request still incomplete after this time is discarded: its client left in the middle of it.
const UNFINISHED: Duration = Duration::from_millis(500);

/// An answer not taken within this time is dropped, as on a cable without a listener.
const UNHEARD: Duration = Duration::from_millis(200);

/// Pause between the two pieces of a split answer: longer than any converter waits before it passes on what it has received.
const PIECES_APART: Duration = Duration::from_millis(30);

/// Faults of an answer, of which only one at a time can take effect.
const OF_AN_ANSWER: [Fault; 8] =
    [Fault::Silent, Fault::Garbage, Fault::Parity, Fault::Split, Fault::Merge, Fault::Err0, Fault::Err1, Fault::Err3];

/// An indicator on a wire.
pub struct Wire<'a> {
    /// The cell.
    pub floor: &'a Floor,
    /// Index of the indicator, from 0.
    pub axis: usize,
    /// The indicator; other wires may lead to it as well.
    pub instrument: &'a RefCell<Instrument>,
}

impl Wire<'_> {
    /// Answers requests on `stream` until its other end is closed.
    ///
    /// # Errors
    /// Those of the stream.
    pub async fn converse(&self, stream: &mut (impl AsyncRead + AsyncWrite + Unpin)) -> io::Result<()> {
        let mut lines = LineReader::default();
        let mut buffer = [0; 256];
        loop {
            let sends_by_itself = self.instrument.borrow().sends_by_itself();
            tokio::select! {
                read = stream.read(&mut buffer) => match read? {
                    0 => return Ok(()),
                    length => {
                        self.floor.traffic.note_indicator_request(length);
                        lines.push(&buffer[..length]);
                    }
                },
                () = sleep(UNFINISHED), if lines.is_amid_line() => lines.clear(),
                () = sleep(self.floor.wall(READING_S).max(UNHEARD / 2)), if sends_by_itself => {
                    let value = self.instrument.borrow_mut().value(&mut self.floor.plunger(self.axis));
                    if let Some(value) = value {
                        self.send(stream, &value).await?;
                    }
                }
            }
            while let Some(request) = lines.line() {
                self.answer(stream, &request).await?;
            }
        }
    }

    async fn answer(&self, stream: &mut (impl AsyncWrite + Unpin), request: &[u8]) -> io::Result<()> {
        self.floor.asked();
        if self.instrument.borrow().is_for_value(request) {
            self.floor.wait(READING_S).await;
        }
        let answer = self.instrument.borrow_mut().answer(request, &mut self.floor.plunger(self.axis));
        let Some(answer) = answer else { return Ok(()) };
        let struck = self.floor.faults.borrow_mut().which(&OF_AN_ANSWER, self.axis);
        match struck {
            Some(Fault::Silent) => Ok(()),
            Some(Fault::Garbage) => {
                let garbage = self.floor.faults.borrow_mut().garbage();
                self.send(stream, &garbage).await
            }
            Some(Fault::Parity) => {
                self.send(stream, &answer.iter().map(|&byte| with_even_parity(byte)).collect::<Vec<u8>>()).await
            }
            Some(Fault::Split) => {
                let (first, second) = answer.split_at(answer.len() / 2);
                self.send(stream, first).await?;
                sleep(PIECES_APART).await;
                self.send(stream, second).await
            }
            Some(Fault::Merge) => self.send(stream, &[answer.as_slice(), answer.as_slice()].concat()).await,
            Some(Fault::Err0) => self.send(stream, b"ERR0\r").await,
            Some(Fault::Err1) => self.send(stream, b"ERR1\r").await,
            Some(Fault::Err3) => self.send(stream, b"ERR3\r").await,
            _ => self.send(stream, &answer).await,
        }
    }

    /// Sends the bytes in one piece.
    async fn send(&self, stream: &mut (impl AsyncWrite + Unpin), bytes: &[u8]) -> io::Result<()> {
        self.floor.traffic.note_indicator_answer(bytes.len());
        timeout(UNHEARD, stream.write_all(bytes)).await.unwrap_or(Ok(()))
    }
}

/// Adds an even parity bit to seven data bits, as seen by a client with eight data bits.
fn with_even_parity(byte: u8) -> u8 {
    byte | if byte.count_ones() % 2 == 1 { 0x80 } else { 0 }
}
