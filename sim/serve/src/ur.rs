//! The robot as a Universal Robot: real-time data exchange (RTDE), the interfaces that take programs, the dashboard.

mod controller;
mod dashboard;
mod functions;
mod programs;
mod rtde;

use std::io;
use std::net::Ipv4Addr;
use std::rc::Rc;

use calibench_wire::ur::ports;
use tokio::net::TcpListener;
use tokio::task::spawn_local;

pub use controller::Controller;

/// Ports that take programs; all but the real-time interface send the robot's state.
const PROGRAMS: [u16; 3] = [ports::PRIMARY, ports::SECONDARY, ports::REALTIME];

/// Attempts to find as many free ports at the right distances.
const MOST_TRIES: usize = 200;

/// The sockets of the controller.
pub struct Ports {
    rtde: TcpListener,
    programs: Vec<TcpListener>,
    dashboard: TcpListener,
}

impl Ports {
    /// Takes the ports, with RTDE at this one; 0 takes any that are free at the right distances.
    ///
    /// # Errors
    /// When one of them is not to be had.
    pub async fn bind(rtde: u16) -> io::Result<Self> {
        let mut tries = if rtde == 0 { MOST_TRIES } else { 1 };
        loop {
            tries -= 1;
            match Ports::at(rtde).await {
                Err(_) if tries > 0 => {}
                ports => return ports,
            }
        }
    }

    async fn at(rtde: u16) -> io::Result<Self> {
        let rtde = TcpListener::bind((Ipv4Addr::LOCALHOST, rtde)).await?;
        let port = rtde.local_addr()?.port();
        let beside = |usual: u16| TcpListener::bind((Ipv4Addr::LOCALHOST, ports::beside(port, usual)));
        let mut programs = Vec::with_capacity(PROGRAMS.len());
        for usual in PROGRAMS {
            programs.push(beside(usual).await?);
        }
        let dashboard = beside(ports::DASHBOARD).await?;
        Ok(Ports { rtde, programs, dashboard })
    }

    /// `HOST:PORT` of RTDE.
    ///
    /// # Errors
    /// When the system does not tell.
    pub fn address(&self) -> io::Result<String> {
        Ok(self.rtde.local_addr()?.to_string())
    }

    /// Answers on all of them.
    pub fn listen(self, controller: &Rc<Controller>) {
        let Ports { rtde, programs, dashboard } = self;
        spawn_local(rtde::listen(rtde, Rc::clone(controller)));
        for (listener, usual) in programs.into_iter().zip(PROGRAMS) {
            spawn_local(programs::listen(listener, Rc::clone(controller), usual != ports::REALTIME));
        }
        spawn_local(dashboard::listen(dashboard, Rc::clone(controller)));
    }
}
