//! Universal Robots: real-time data exchange, which needs no program and no remote control.

use std::time::Duration;

use calibench::cell::gauge::open_socket;
use calibench_wire::ur::{Client, Recipes};

use super::JointReader;
use crate::ReadoutError;

/// Longest wait for a connection, and for an answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// The exchange with a controller, begun again when it is lost.
pub(super) struct UrExchange {
    address: String,
    client: Option<Client>,
}

impl UrExchange {
    pub fn open(address: &str) -> Result<Self, ReadoutError> {
        let mut exchange = UrExchange { address: address.into(), client: None };
        exchange.joints()?;
        Ok(exchange)
    }

    fn whom(&self) -> String {
        format!("Universal Robot at {}", self.address)
    }

    fn start(&self) -> Result<Client, ReadoutError> {
        let stream = open_socket(&self.address, PATIENCE).map_err(|e| ReadoutError::no_connection(&self.whom(), &e))?;
        let recipes = Recipes { outputs: &["actual_q"], inputs: &[] };
        Client::start(stream, &recipes, PATIENCE).map_err(|e| self.unread(&e))
    }

    fn unread(&self, error: &dyn std::fmt::Display) -> ReadoutError {
        ReadoutError::new(&self.whom(), error.to_string(), "check that RTDE is enabled, and its port (30004)")
    }
}

impl JointReader for UrExchange {
    fn joints(&mut self) -> Result<Vec<f64>, ReadoutError> {
        let mut client = match self.client.take() {
            Some(client) => client,
            None => self.start()?,
        };
        let seen = client.fresh().map_err(|e| self.unread(&e))?;
        self.client = Some(client);
        Ok(seen.six("actual_q").to_vec())
    }
}
