//! A pseudo-terminal: what an indicator's virtual serial port is on Unix.

use std::io;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

use rustix::fs::{Mode, OFlags, open};
use rustix::io::ioctl_fionbio;
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use tokio::io::{Join, join};
use tokio::net::unix::pipe::{Receiver, Sender};

/// A pseudo-terminal; whoever opens its client's end speaks to the instrument's. It is gone from the system when dropped.
pub struct Pty {
    /// The instrument's end.
    pub instrument: Join<Receiver, Sender>,
    /// Without an open client's end, the instrument's would report an error whenever a client leaves.
    _kept_open: OwnedFd,
    path: PathBuf,
}

impl Pty {
    /// A new one, its client's end raw: bytes pass as they are, none is echoed.
    ///
    /// # Errors
    /// When the system gives none.
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
        // To the reactor an end of a terminal is as good as one of a pipe.
        let receiver = Receiver::from_owned_fd_unchecked(instrument.try_clone()?)?;
        let sender = Sender::from_owned_fd_unchecked(instrument)?;
        Ok(Pty { instrument: join(receiver, sender), _kept_open: client, path })
    }

    /// The client's end.
    pub fn path(&self) -> &Path {
        &self.path
    }
}
