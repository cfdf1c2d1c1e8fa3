//! Ports to which indicators are connected.

use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use serialport::{ClearBuffer, DataBits, SerialPort, StopBits};

use super::{LineSettings, Parity};
use crate::cell::socket::connect;

/// Longest duration of one read: short against any deadline, long against a busy loop.
const LOOK: Duration = Duration::from_millis(20);

/// A line to an indicator. Reads wait only briefly, and end with [`ErrorKind::TimedOut`] or [`ErrorKind::WouldBlock`] when
/// nothing came.
pub trait Port: Read + Write {
    /// Discards received bytes that were not read.
    ///
    /// # Errors
    /// When the port is gone.
    fn discard_input(&mut self) -> io::Result<()>;
}

impl Port for Box<dyn SerialPort> {
    fn discard_input(&mut self) -> io::Result<()> {
        Ok(self.clear(ClearBuffer::Input)?)
    }
}

impl Port for TcpStream {
    fn discard_input(&mut self) -> io::Result<()> {
        self.set_nonblocking(true)?;
        let mut waste = [0; 256];
        let end = loop {
            match self.read(&mut waste) {
                // Closed; the next read reports it.
                Ok(0) => break Ok(()),
                Ok(_) => {}
                Err(e) if e.kind() == ErrorKind::WouldBlock => break Ok(()),
                Err(e) => break Err(e),
            }
        };
        self.set_nonblocking(false)?;
        end
    }
}

impl Port for Box<dyn Port + Send> {
    fn discard_input(&mut self) -> io::Result<()> {
        (**self).discard_input()
    }
}

/// Opens a serial port, real or virtual, e.g. `/dev/ttyUSB0`, `COM3`.
///
/// # Errors
/// When there is no port of that name, or it is in use.
pub fn open_serial(path: &str, line: LineSettings) -> io::Result<Box<dyn SerialPort>> {
    let parity = match line.parity {
        Parity::None => serialport::Parity::None,
        Parity::Even => serialport::Parity::Even,
        Parity::Odd => serialport::Parity::Odd,
    };
    let data_bits = if line.data_bits == 7 { DataBits::Seven } else { DataBits::Eight };
    let stop_bits = if line.stop_bits == 2 { StopBits::Two } else { StopBits::One };
    let port = serialport::new(path, line.baud).data_bits(data_bits).parity(parity).stop_bits(stop_bits);
    Ok(port.timeout(LOOK).open()?)
}

/// Connects to an indicator behind a socket, `HOST:PORT`.
///
/// # Errors
/// When there is no answer within `timeout`.
pub fn open_socket(address: &str, timeout: Duration) -> io::Result<TcpStream> {
    let stream = connect(address, timeout)?;
    stream.set_read_timeout(Some(LOOK))?;
    stream.set_write_timeout(Some(timeout))?;
    Ok(stream)
}
