//! A pseudo-terminal: an indicator's virtual serial port on Unix.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags, open};
use rustix::io::ioctl_fionbio;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use tokio::io::{Join, join};
use tokio::net::unix::pipe::{Receiver, Sender};

/// A pseudo-terminal; a program that opens the client's end talks to the instrument's end. It is removed from the
/// system on drop.
pub struct Pty {
    /// The instrument's end.
    pub instrument: Join<Receiver, Sender>,
    /// Keeps the client's end open: otherwise the instrument's end would report an error whenever a client leaves.
    _kept_open: OwnedFd,
    path: PathBuf,
}

impl Pty {
    /// Opens a pseudo-terminal with its client's end in raw mode: bytes pass unchanged, none is echoed.
    ///
    /// # Errors
    /// When the system provides none.
    pub fn open() -> io::Result<Pty> {
        let instrument = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)?;
        grantpt(&instrument)?;
        unlockpt(&instrument)?;
        let path = PathBuf::from(ptsname(&instrument, Vec::new())?.into_string().map_err(io::Error::other)?);
        let client = open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut attributes = tcgetattr(&client)?;
        attributes.make_raw();
        tcsetattr(&client, OptionalActions::Now, &attributes)?;
        ioctl_fionbio(&instrument, true)?;
        // The reactor treats an end of a terminal like an end of a pipe.
        let receiver = Receiver::from_owned_fd_unchecked(instrument.try_clone()?)?;
        let sender = Sender::from_owned_fd_unchecked(instrument)?;
        Ok(Pty { instrument: join(receiver, sender), _kept_open: client, path })
    }

    /// Path of the client's end.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
