//! The installed viewer has the version of the recorder, so it can read the recordings.

const LOCK: &str = include_str!("../../../../Cargo.lock");
const WANTED: &str = include_str!("../../requirements.in");
const PINNED: &str = include_str!("../../requirements.txt");

#[test]
fn recorder_and_viewer_are_of_one_version() {
    let (_, after) = LOCK.split_once("name = \"rerun\"\nversion = \"").unwrap();
    let pin = format!("rerun-sdk=={}", after.split_once('"').unwrap().0);
    assert!(WANTED.lines().any(|line| line == pin), "sim/view/requirements.in does not say {pin}");
    assert!(
        PINNED.lines().any(|line| line.trim_end_matches([' ', '\\']) == pin),
        "sim/view/requirements.txt does not hold {pin}"
    );
}
