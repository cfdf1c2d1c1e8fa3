//! The workbench answers only the page that it served itself, on this machine.

use std::collections::BTreeSet;
use std::fs;
use std::net::TcpStream;
use std::path::Path;

use crate::program::{done, scenario};
use crate::workbench::Workbench;
use serde_json::json;

/// A dataset of the perfect cell, and files beside it.
fn measured() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    done(folder.path(), &["measure", &scenario("perfect.toml"), "-o", "data"]);
    fs::write(folder.path().join("secret.toml"), "effects = [\"mdh\"]\n").unwrap();
    folder
}

/// All files below a folder, with their content.
fn content(folder: &Path) -> BTreeSet<(String, Vec<u8>)> {
    let mut all = BTreeSet::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            all.extend(content(&path));
        } else {
            all.insert((path.display().to_string(), fs::read(&path).unwrap()));
        }
    }
    all
}

#[test]
fn only_its_own_page_is_answered() {
    let folder = measured();
    let before = content(folder.path());
    let bench = Workbench::start(folder.path(), &["data"]);
    let document = "/api/document";
    let status = |headers: &[(&str, &str)]| bench.ask("GET", document, headers, "").status;
    let port = bench.port;

    // Requests as made by the page.
    assert_eq!(status(&[]), 200);
    assert_eq!(status(&[("Host", &format!("localhost:{port}"))]), 200);
    assert_eq!(status(&[("Origin", &format!("http://127.0.0.1:{port}"))]), 200);
    assert_eq!(status(&[("Sec-Fetch-Site", "same-origin")]), 200);
    let page = bench.ask("GET", bench.url.split_once(&port.to_string()).unwrap().1, &[("X-Calibench-Token", "")], "");
    assert_eq!(page.status, 200);
    assert!(!page.body.contains(&bench.token), "the page does not hold the token");

    // Without the token, or with a wrong one.
    assert_eq!(status(&[("X-Calibench-Token", "")]), 401);
    let first = if bench.token.starts_with('0') { "1" } else { "0" };
    assert_eq!(status(&[("X-Calibench-Token", &format!("{first}{}", &bench.token[1..]))]), 401);
    assert_eq!(status(&[("X-Calibench-Token", &bench.token[1..])]), 401);
    assert_eq!(status(&[("X-Calibench-Token", &format!("{}0", bench.token))]), 401);
    assert_eq!(status(&[("X-Calibench-Token", ""), ("Cookie", &format!("token={}", bench.token))]), 401);
    let in_address = format!("{document}?token={}", bench.token);
    assert_eq!(bench.ask("GET", &in_address, &[("X-Calibench-Token", "")], "").status, 401);
    for path in ["/", "/?token=", "/?token=0", "/?other=1"] {
        let refused = bench.ask("GET", path, &[("X-Calibench-Token", "")], "");
        assert_eq!(refused.status, 401, "{path}");
        assert!(!refused.body.contains("<script"), "{path}");
    }

    // By the name of another site that resolves here (DNS rebinding), or by no name.
    assert_eq!(status(&[("Host", "evil.example")]), 421);
    assert_eq!(status(&[("Host", &format!("evil.example:{port}"))]), 421);
    assert_eq!(status(&[("Host", &format!("127.0.0.1:{}", port ^ 1))]), 421);
    assert_eq!(status(&[("Host", "127.0.0.1")]), 421);
    let whole = bench.ask("GET", &format!("http://evil.example:{port}{document}"), &[], "");
    assert_eq!(whole.status, 421);
    assert!([400, 421].contains(&status(&[("Host", "")])), "HTTP/1.1 without a host");
    let twice = format!(
        "GET {document} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nHost: evil.example\r\nX-Calibench-Token: {}\r\nConnection: close\r\n\r\n",
        bench.token
    );
    assert!([400, 421].contains(&bench.raw(twice.as_bytes()).status), "two hosts");

    // From a page of another site.
    assert_eq!(status(&[("Origin", "http://evil.example")]), 403);
    assert_eq!(status(&[("Origin", "null")]), 403);
    assert_eq!(status(&[("Origin", &format!("https://127.0.0.1:{port}"))]), 403);
    assert_eq!(status(&[("Origin", &format!("http://127.0.0.1:{}", port ^ 1))]), 403);
    assert_eq!(status(&[("Sec-Fetch-Site", "cross-site")]), 403);
    assert_eq!(status(&[("Sec-Fetch-Site", "same-site")]), 403);
    let posted = bench.ask("POST", "/api/save-model", &[("Origin", "http://evil.example")], "{}");
    assert_eq!(posted.status, 403);
    // Requests that a form of another site can send without a preflight.
    let form = bench.ask("POST", "/api/undo", &[("Content-Type", "text/plain")], "{}");
    assert_eq!(form.status, 415);
    let asked_first = bench.ask("OPTIONS", "/api/undo", &[("Origin", "http://evil.example"), ("X-Calibench-Token", "")], "");
    assert_eq!(asked_first.status, 403);
    assert!(!asked_first.head.to_lowercase().contains("access-control"), "{}", asked_first.head);

    // By methods that are not supported.
    for method in ["PUT", "DELETE", "PATCH", "TRACE", "BREW"] {
        assert_eq!(bench.ask(method, document, &[], "").status, 405, "{method}");
    }
    assert_eq!(bench.ask("POST", document, &[], "{}").status, 405);
    assert_eq!(bench.ask("GET", "/api/undo", &[], "").status, 405);
    assert_eq!(bench.ask("POST", "/api/switch", &[], "not JSON").status, 400);
    assert_eq!(bench.ask("POST", "/api/switch", &[], r#"{"effect": 1}"#).status, 400);
    assert_eq!(bench.ask("POST", "/api/save-model", &[], r#"{"path": "../secret.toml"}"#).status, 400);
    let long = json!({"effect": "x".repeat(70_000)}).to_string();
    assert_eq!(bench.ask("POST", "/api/switch", &[], &long).status, 413);
    let said_long = bench.ask("POST", "/api/switch", &[("Content-Length", "99999999999")], "{}");
    assert_eq!(said_long.status, 413);
    let endless = format!("GET {document} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nX-Long: {}\r\n\r\n", "x".repeat(1 << 20));
    assert!([400, 431, 0].contains(&bench.raw(endless.as_bytes()).status), "endless headers");

    // Paths that leave the folders, wherever text is accepted.
    for path in [
        "/../secret.toml",
        "/api/../../secret.toml",
        "/%2e%2e/secret.toml",
        "//etc/passwd",
        "/data/samples.csv",
        "/api/document/..",
    ] {
        let answer = bench.ask("GET", path, &[], "");
        assert_eq!(answer.status, 404, "{path}");
    }
    for hostile in ["../secret.toml", "/etc/passwd", "data/../secret.toml", "file:///etc/passwd", "..", "\u{0}", "mdh\n../x"] {
        let post = |action: &str, body: serde_json::Value| {
            let answer = bench.ask("POST", action, &[], &body.to_string());
            assert!(!answer.body.contains("root:"), "{action} {hostile:?}");
            (action.to_owned(), answer.status)
        };
        let own = |name: &str, unit: &str, site: &str, expressions: &str| {
            post("/api/own", json!({"name": name, "unit": unit, "site": site, "expressions": expressions}))
        };
        let all = [
            post("/api/switch", json!({"effect": hostile, "on": true})),
            post("/api/candidate", json!({"effect": hostile})),
            post("/api/choose", json!({"datasets": [hostile]})),
            own(hostile, "deg", "theta:1", "q1"),
            own("mine", hostile, "theta:1", "q1"),
            own("mine", "deg", hostile, "q1"),
            own("mine", "deg", "theta:1", hostile),
        ];
        for (action, status) in all {
            assert_eq!(status, 422, "{action} {hostile:?}");
        }
    }

    // None of it has read or changed anything.
    assert_eq!(content(folder.path()), before);
    assert_eq!(bench.get("document")["live"]["can_undo"], false);

    // Answers are not to be cached or framed.
    let head = page.head.to_lowercase();
    for promised in [
        "cache-control: no-store",
        "referrer-policy: no-referrer",
        "x-content-type-options: nosniff",
        "default-src 'none'",
        "connect-src 'self'",
        "frame-ancestors 'none'",
        "script-src 'nonce-",
    ] {
        assert!(head.contains(promised), "{promised}: {head}");
    }
    assert!(!head.contains("set-cookie") && !head.contains("access-control"), "{head}");
    assert!(!head.split("script-src").nth(1).unwrap().split(';').next().unwrap().contains("unsafe"), "{head}");
}

/// A listener on all addresses would be reachable on all of 127.0.0.0/8 under Linux.
#[test]
fn it_listens_on_one_address() {
    let folder = measured();
    let bench = Workbench::start(folder.path(), &["data"]);
    assert!(TcpStream::connect(("127.0.0.1", bench.port)).is_ok());
    for other in ["127.0.0.2", "::1"] {
        assert!(TcpStream::connect((other, bench.port)).is_err(), "{other}");
    }
    #[cfg(target_os = "linux")]
    {
        let listening = fs::read_to_string("/proc/net/tcp").unwrap();
        let port = format!(":{:04X}", bench.port);
        // Column 1 is the local address, column 3 the state: 0A is listening.
        let rows: Vec<Vec<&str>> = listening.lines().map(|l| l.split_whitespace().collect()).collect();
        let here: Vec<&str> = rows.iter().filter(|r| r[1].ends_with(&port) && r[3] == "0A").map(|r| r[1]).collect();
        assert_eq!(here, [format!("0100007F{port}")], "127.0.0.1 in the byte order of the machine");
    }
}

#[cfg(unix)]
#[test]
fn it_writes_two_files_where_it_may_and_leaves_nothing_else() {
    let folder = measured();
    let bench = Workbench::start(folder.path(), &["data", "--save-to", "kept"]);
    let before = content(folder.path());
    assert!(!folder.path().join("kept").exists());
    bench.act("save-model", &json!({}));
    bench.act("save-report", &json!({}));
    let port = bench.port;
    assert_eq!(bench.interrupt(), Some(0));
    assert!(TcpStream::connect(("127.0.0.1", port)).is_err());
    let new: Vec<String> = content(folder.path()).difference(&before).map(|(path, _)| path.clone()).collect();
    let names: Vec<&str> = new.iter().map(|p| p.rsplit_once("/kept/").unwrap().1).collect();
    assert_eq!(names, ["model.toml", "report.html"]);
}
