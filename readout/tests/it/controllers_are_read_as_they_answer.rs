//! Servers of our own answer as the makers' pages and manuals say; the log-in of an ABB is computed again from RFC 2617.

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex};

use calibench_readout::{AbbSettings, Controller, FanucSettings, LogIn};
use md5::{Digest, Md5};

/// What a server was asked: the first line, and the headers by their names in lower case.
#[derive(Debug, Clone)]
struct Asked {
    line: String,
    headers: BTreeMap<String, String>,
}

/// Serves HTTP until the process ends; returns its address, and what it was asked.
fn serve(answer: impl Fn(&Asked) -> String + Send + Sync + 'static) -> (String, Arc<Mutex<Vec<Asked>>>) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    let asked = Arc::new(Mutex::new(Vec::new()));
    let (seen, answer) = (Arc::clone(&asked), Arc::new(answer));
    std::thread::spawn(move || {
        for stream in listener.incoming() {
            let (mut stream, seen, answer) = (stream.unwrap(), Arc::clone(&seen), Arc::clone(&answer));
            std::thread::spawn(move || {
                let mut lines = BufReader::new(stream.try_clone().unwrap());
                while let Some(request) = read_request(&mut lines) {
                    seen.lock().unwrap().push(request.clone());
                    if stream.write_all(answer(&request).as_bytes()).is_err() {
                        break;
                    }
                }
            });
        }
    });
    (address, asked)
}

fn read_request(lines: &mut BufReader<TcpStream>) -> Option<Asked> {
    let mut line = String::new();
    lines.read_line(&mut line).ok().filter(|&read| read > 0)?;
    let mut headers = BTreeMap::new();
    loop {
        let mut header = String::new();
        lines.read_line(&mut header).ok()?;
        let Some((name, value)) = header.trim().split_once(':') else { break };
        headers.insert(name.to_lowercase(), value.trim().to_owned());
    }
    Some(Asked { line: line.trim().to_owned(), headers })
}

fn page(status: &str, headers: &str, body: &str) -> String {
    format!("HTTP/1.1 {status}\r\n{headers}Content-Length: {}\r\n\r\n{body}", body.len())
}

#[test]
fn a_fanuc_by_the_page_of_its_positions() {
    let body = "<HTML><PRE>\nGroup #:  1\nCURRENT JOINT POSITION:\nJoint   1:     10.25\nJoint   2:      -.50\nJoint   3:    -10.99\nJoint   4:     56.19\nJoint   5:    -81.55\nJoint   6:    -94.01\n\nGroup #:  2\nJoint   1:     12.34\n</PRE>";
    let (address, asked) = serve(move |_| page("200 OK", "", body));
    let settings =
        |group| Controller::Fanuc(FanucSettings { address: address.clone(), group, is_coupled: false, log_in: None });
    let mut reader = settings(1).open().unwrap().unwrap();
    for _ in 0..3 {
        assert_eq!(reader.joints().unwrap(), [10.25, -0.5, -10.99, 56.19, -81.55, -94.01]);
    }
    // Joint 3 of the pendant counts from the horizontal; that of a model from the link before.
    let coupled = FanucSettings { address: address.clone(), group: 1, is_coupled: true, log_in: None };
    let third = Controller::Fanuc(coupled).open().unwrap().unwrap().joints().unwrap()[2];
    assert!((third - (-10.99 - 0.5)).abs() < 1e-12);
    assert!(asked.lock().unwrap().iter().all(|asked| asked.line == "GET /MD/CURPOS.DG HTTP/1.1"));
    assert_eq!(settings(2).open().unwrap().unwrap().joints().unwrap(), [12.34]);
    let said = settings(3).open().unwrap().unwrap().joints().unwrap_err().to_string();
    assert!(said.contains("no joints of motion group 3"), "{said}");
}

fn hex(text: &str) -> String {
    Md5::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The value of `name` in the header of a log-in.
fn value(header: &str, name: &str) -> String {
    let after = header.split(&format!("{name}=")).nth(1).unwrap_or_default();
    after.trim_start_matches('"').split(['"', ',']).next().unwrap_or_default().to_owned()
}

#[test]
fn an_abb_by_its_web_services_with_a_log_in_and_one_session() {
    let unauthorised = page(
        "401 Unauthorized",
        "WWW-Authenticate: Digest realm=\"validusers@robapi.abb\", domain=\"/\", qop=\"auth\", nonce=\"9001ce:4f6a\", opaque=\"799d5\", algorithm=\"MD5\", stale=\"FALSE\"\r\nSet-Cookie: -http-session-=1::http.session::abc; path=/; HttpOnly\r\n",
        "",
    );
    let spans: String = (1..=6).map(|k| format!("<span class=\"rax_{k}\">{}.125</span>", 10 * k)).collect();
    let (address, asked) = serve(move |asked| {
        let Some(login) = asked.headers.get("authorization") else { return unauthorised.clone() };
        let path = asked.line.split(' ').nth(1).unwrap();
        let secret = hex("Default User:validusers@robapi.abb:robotics");
        let parts = [
            &secret,
            &value(login, "nonce"),
            &value(login, "nc"),
            &value(login, "cnonce"),
            &value(login, "qop"),
            &hex(&format!("GET:{path}")),
        ];
        let wanted = hex(&parts.map(String::as_str).join(":"));
        if value(login, "response") != wanted || value(login, "uri") != path {
            return unauthorised.clone();
        }
        page(
            "200 OK",
            "Set-Cookie: ABBCX=17; path=/\r\n",
            &format!("<ul><li class=\"ms-jointtarget\">{spans}<span class=\"eax_a\">9E+09</span></li></ul>"),
        )
    });
    let who = |password: &str| Some(LogIn { user: AbbSettings::USER[0].to_owned(), password: password.to_owned() });
    let settings = |unit: &str, password| {
        Controller::Abb(AbbSettings { address: address.clone(), unit: unit.into(), log_in: who(password) })
    };
    let mut reader = settings("ROB_1", "robotics").open().unwrap().unwrap();
    for _ in 0..4 {
        assert_eq!(reader.joints().unwrap(), [10.125, 20.125, 30.125, 40.125, 50.125, 60.125]);
    }
    let seen = asked.lock().unwrap().clone();
    // Asked for its name once, and in one session from then on: a controller has seventy.
    assert_eq!(seen.len(), 5);
    assert!(seen.iter().all(|asked| asked.line == "GET /rw/motionsystem/mechunits/ROB_1/jointtarget HTTP/1.1"));
    assert_eq!(seen[0].headers.get("cookie"), None);
    assert_eq!(seen[4].headers["cookie"], "-http-session-=1::http.session::abc; ABBCX=17");
    let mut of_task = settings("T_ROB1", "robotics").open().unwrap().unwrap();
    assert_eq!(of_task.joints().unwrap().len(), 6);
    assert!(asked.lock().unwrap().last().unwrap().line.starts_with("GET /rw/rapid/tasks/T_ROB1/motion?resource=jointtarget "));
    let said = settings("ROB_1", "wrong").open().unwrap().unwrap().joints().unwrap_err().to_string();
    assert!(said.contains("refuses the log-in"), "{said}");
}

#[test]
fn a_server_that_answers_nonsense_is_one_clear_error() {
    for answer in ["HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", "hello\r\n\r\n"] {
        let (address, _) = serve(move |_| answer.to_owned());
        for controller in [
            Controller::Fanuc(FanucSettings { address: address.clone(), group: 1, is_coupled: true, log_in: None }),
            Controller::Abb(AbbSettings { address: address.clone(), unit: "ROB_1".into(), log_in: None }),
        ] {
            let error = controller.open().unwrap().unwrap().joints().unwrap_err();
            assert!(error.whom.contains(&address) && !error.remedy.is_empty(), "{error}");
        }
    }
    // Nobody listens there any more.
    let address = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    for controller in [
        Controller::Kuka(address.clone()),
        Controller::Ur(address.clone()),
        Controller::Fanuc(FanucSettings { address: address.clone(), group: 1, is_coupled: true, log_in: None }),
    ] {
        let read = controller.open().and_then(|reader| reader.unwrap().joints());
        let said = read.unwrap_err().to_string();
        assert!(said.contains(&address), "{said}");
    }
}

#[test]
fn a_controller_that_sends_lines_is_asked_for_them() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut asked = [0; 8];
        while stream.read_exact(&mut asked[..4]).is_ok() {
            assert_eq!(&asked[..4], b"GET\n");
            stream.write_all(b"hello\r\nJ,1.5,-2.5,3,4,5,6.25\r\n").unwrap();
        }
    });
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("station.toml");
    let text = format!(
        "format = \"calibench-station/1\"\n[controller]\nkind = \"text\"\naddress = \"{address}\"\nask = 'GET\\n'\nline = \"J,{{q1}},{{q2}},{{q3}},{{q4}},{{q5}},{{q6}}\"\n"
    );
    std::fs::write(&file, text).unwrap();
    let station = calibench_readout::read_station(&file).unwrap();
    let mut reader = station.controller.open().unwrap().unwrap();
    for _ in 0..3 {
        assert_eq!(reader.joints().unwrap(), [1.5, -2.5, 3.0, 4.0, 5.0, 6.25]);
    }
}
