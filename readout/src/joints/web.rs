//! Requests to the web server of a controller.

use std::time::Duration;

use http_auth::{PasswordClient, PasswordParams};
use ureq::http::{Response, StatusCode, Uri, header};
use ureq::{Agent, Body};

use crate::ReadoutError;

/// Longest wait for an answer.
const ANSWER: Duration = Duration::from_secs(5);
/// Longest answer that is read, bytes: a page of positions has 5,000.
const LONGEST: u64 = 1 << 20;

/// Who logs in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogIn {
    /// User.
    pub user: String,
    /// Password.
    pub password: String,
}

/// A client of one web server, which keeps its connection, its session and its log-in.
pub(super) struct Web {
    whom: String,
    host: String,
    log_in: Option<LogIn>,
    agent: Agent,
    answers_by: Option<PasswordClient>,
    cookies: Vec<String>,
}

/// What a web server answered.
pub(super) struct Answer {
    /// Status of HTTP.
    pub status: StatusCode,
    /// The text.
    pub text: String,
}

impl Web {
    /// A client for the server at `HOST` or `HOST:PORT`, with user and password where it asks for them.
    pub fn new(whom: &str, host: &str, log_in: Option<LogIn>) -> Self {
        // A proxy of the office does not know the robot's network.
        let config = Agent::config_builder().timeout_global(Some(ANSWER)).http_status_as_error(false).proxy(None);
        let agent = config.build().new_agent();
        Web { whom: whom.into(), host: host.into(), log_in, agent, answers_by: None, cookies: Vec::new() }
    }

    /// Whom it asks, for messages.
    pub fn whom(&self) -> &str {
        &self.whom
    }

    /// Gets what lies at a path.
    ///
    /// # Errors
    /// If nobody answers, or the log-in is refused.
    pub fn get(&mut self, path: &str, accept: &str) -> Result<Answer, ReadoutError> {
        let mut response = self.ask(path, accept)?;
        if response.status() == StatusCode::UNAUTHORIZED {
            self.answers_by = self.log_in.as_ref().and_then(|_| {
                let asked = response.headers().get_all(header::WWW_AUTHENTICATE).iter();
                let said = asked.filter_map(|value| value.to_str().ok());
                said.fold(PasswordClient::builder(), |builder, value| builder.challenges(value)).build().ok()
            });
            if self.answers_by.is_some() {
                response = self.ask(path, accept)?;
            }
        }
        let status = response.status();
        if matches!(status, StatusCode::UNAUTHORIZED | StatusCode::FORBIDDEN) {
            let remedy = "give `user` and `password` of somebody who may read positions";
            return Err(ReadoutError::new(&self.whom, format!("refuses the log-in ({status})"), remedy));
        }
        let text = response.body_mut().with_config().limit(LONGEST).read_to_vec();
        let text = text.map_err(|e| self.no_answer(&e))?;
        Ok(Answer { status, text: String::from_utf8_lossy(&text).into_owned() })
    }

    fn ask(&mut self, path: &str, accept: &str) -> Result<Response<Body>, ReadoutError> {
        let address = format!("http://{}{path}", self.host);
        let uri: Uri = address.parse().map_err(|_| {
            ReadoutError::new(&self.whom, format!("'{}' is not an address", self.host), "give it as HOST or HOST:PORT")
        })?;
        let mut request = self.agent.get(&uri).header(header::ACCEPT, accept);
        if let (Some(client), Some(LogIn { user, password })) = (&mut self.answers_by, &self.log_in) {
            let path = uri.path_and_query().map_or(path, |at| at.as_str());
            let parameters = PasswordParams { username: user, password, uri: path, method: "GET", body: Some(&[]) };
            if let Ok(credentials) = client.respond(&parameters) {
                request = request.header(header::AUTHORIZATION, credentials);
            }
        }
        // A controller has few sessions, and opens one for every request that names none.
        if !self.cookies.is_empty() {
            request = request.header(header::COOKIE, self.cookies.join("; "));
        }
        let response = request.call().map_err(|e| self.no_answer(&e))?;
        for cookie in response.headers().get_all(header::SET_COOKIE) {
            let Some(cookie) = cookie.to_str().ok().and_then(|text| text.split(';').next()) else { continue };
            let name = cookie.split('=').next().unwrap_or_default().to_owned();
            self.cookies.retain(|kept| kept.split('=').next() != Some(&name));
            self.cookies.push(cookie.trim().to_owned());
        }
        Ok(response)
    }

    fn no_answer(&self, error: &ureq::Error) -> ReadoutError {
        let remedy = "check the address, the cable, and that the controller's web server is on";
        ReadoutError::new(&self.whom, format!("no answer ({error})"), remedy)
    }
}
