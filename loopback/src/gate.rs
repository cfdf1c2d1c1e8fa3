//! Access control of a page: only the page it served itself, on this machine, with the token.

use axum::http::header::{CONTENT_TYPE, HOST, HeaderMap, HeaderName, ORIGIN};
use axum::http::{Method, StatusCode, Uri};
use rand::TryRng;
use rand::rngs::{SysError, SysRng};
use subtle::ConstantTimeEq;

/// Header in which the page sends the token. No form or image can set it, and a script of another site would need permission
/// first (CORS preflight).
const TOKEN: HeaderName = HeaderName::from_static("x-calibench-token");

/// A browser's statement of a request's origin (Fetch Metadata Request Headers, W3C).
const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// Number of random bytes in a token.
const BYTES: usize = 32;

/// Guards one server.
pub struct Gate {
    token: String,
    hosts: [String; 2],
}

/// The reason for rejecting a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Turned(pub StatusCode, pub &'static str);

impl Gate {
    /// A gate for the server at that port of the loopback address, with a new token.
    ///
    /// # Errors
    /// If the system provides no random numbers.
    pub fn new(port: u16) -> Result<Self, SysError> {
        Ok(Gate { token: random_hex()?, hosts: [format!("127.0.0.1:{port}"), format!("localhost:{port}")] })
    }

    /// The page's address, token included.
    pub fn url(&self) -> String {
        format!("http://{}/?token={}", self.hosts[0], self.token)
    }

    /// Accepts a request or gives the reason for rejecting it. The page itself is requested with the token in its address,
    /// everything else with the token in a header.
    ///
    /// # Errors
    /// The first reason for rejection.
    pub fn judge(&self, method: &Method, uri: &Uri, headers: &HeaderMap) -> Result<(), Turned> {
        let is_here = |text: &str| self.hosts.iter().any(|h| h == text);
        // A foreign host name that resolves here (DNS rebinding) is not a name of this server.
        let mut hosts = headers.get_all(HOST).iter();
        let host = hosts.next().and_then(|h| h.to_str().ok());
        if hosts.next().is_some() || !host.is_some_and(is_here) || uri.authority().is_some_and(|a| !is_here(a.as_str())) {
            return Err(Turned(StatusCode::MISDIRECTED_REQUEST, "this host name is not served here"));
        }
        let origin_is_here = |o: &str| o.strip_prefix("http://").is_some_and(is_here);
        if headers.get_all(ORIGIN).iter().any(|o| !o.to_str().is_ok_and(origin_is_here)) {
            return Err(Turned(StatusCode::FORBIDDEN, "requests of other sites are not answered"));
        }
        // `none`: typed or opened by the user.
        if headers.get_all(FETCH_SITE).iter().any(|s| s != "same-origin" && s != "none") {
            return Err(Turned(StatusCode::FORBIDDEN, "requests of other sites are not answered"));
        }
        let of_address = || uri.query()?.split('&').find_map(|pair| pair.strip_prefix("token="));
        let given = if uri.path() == "/" { of_address() } else { headers.get(TOKEN).and_then(|t| t.to_str().ok()) };
        let right = given.is_some_and(|given| bool::from(given.as_bytes().ct_eq(self.token.as_bytes())));
        if !right {
            return Err(Turned(StatusCode::UNAUTHORIZED, "open the address that calibench printed, with its token"));
        }
        if method == Method::POST && headers.get(CONTENT_TYPE).is_none_or(|t| t != "application/json") {
            return Err(Turned(StatusCode::UNSUPPORTED_MEDIA_TYPE, "send application/json"));
        }
        Ok(())
    }
}

/// Random bytes as hexadecimal digits.
///
/// # Errors
/// If the system provides no random numbers.
pub fn random_hex() -> Result<String, SysError> {
    let mut bytes = [0; BYTES];
    SysRng.try_fill_bytes(&mut bytes)?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_gates_have_two_long_tokens() {
        let [a, b] = [1, 2].map(|port| Gate::new(port).expect("random numbers"));
        assert_ne!(a.token, b.token);
        assert_eq!(a.token.len(), 2 * BYTES);
        assert!(a.url().ends_with(&a.token));
    }
}
