//! The viewer that is installed is the one that reads what is written: the version of the recorder, pinned with hashes.
#![allow(clippy::unwrap_used)]

const LOCK: &str = include_str!("../../../Cargo.lock");
const WANTED: &str = include_str!("../requirements.in");
const PINNED: &str = include_str!("../requirements.txt");

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

#[test]
fn every_package_has_hashes() {
    let mut packages: Vec<(&str, usize)> = Vec::new();
    for line in PINNED.lines() {
        if line.trim().starts_with("--hash=sha256:") {
            packages.last_mut().expect("a hash stands below its package").1 += 1;
        } else if let Some((name, _)) = line.split_once("==").filter(|_| !line.starts_with([' ', '#'])) {
            packages.push((name, 0));
        }
    }
    assert!(packages.len() > 1, "nothing is pinned");
    for (name, hashes) in packages {
        assert!(hashes > 0, "sim/view/requirements.txt: {name} has no hash");
    }
}
