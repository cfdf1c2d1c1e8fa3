//! Requests from the user or the system to end the program.

use std::io;

/// Completes when the program is asked to end; listens from the call on. Must be called inside a tokio runtime.
///
/// # Errors
/// When the system provides no signals.
#[cfg(unix)]
pub fn interrupted() -> io::Result<impl Future<Output = ()>> {
    use tokio::signal::unix::{SignalKind, signal};
    let (mut interrupt, mut terminate) = (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?);
    Ok(async move {
        tokio::select! {
            _ = interrupt.recv() => (),
            _ = terminate.recv() => (),
        }
    })
}

/// Completes when the program is asked to end; without Unix signals, on Ctrl-C at the console.
///
/// # Errors
/// Never.
#[cfg(not(unix))]
pub fn interrupted() -> io::Result<impl Future<Output = ()>> {
    Ok(async { drop(tokio::signal::ctrl_c().await) })
}
