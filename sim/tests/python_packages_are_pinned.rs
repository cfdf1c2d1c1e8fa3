//! Every Python package that the feature `mujoco` brings is pinned with hashes: what runs tomorrow is what ran today, byte for byte.

const WANTED: &str = include_str!("../requirements.in");
const PINNED: &str = include_str!("../requirements.txt");

/// Package and version of a line that pins one.
fn pin(line: &str) -> Option<(&str, &str)> {
    line.trim_end_matches([' ', '\\']).split_once("==").filter(|(name, _)| !name.starts_with([' ', '#']))
}

#[test]
fn what_is_wanted_is_pinned_and_every_pin_has_hashes() {
    let mut packages: Vec<((&str, &str), usize)> = Vec::new();
    for line in PINNED.lines() {
        if let Some(package) = pin(line) {
            packages.push((package, 0));
        } else if line.trim().starts_with("--hash=sha256:") {
            packages.last_mut().expect("a hash stands below its package").1 += 1;
        }
    }
    for (package, hashes) in &packages {
        assert!(*hashes > 0, "sim/requirements.txt: {package:?} has no hash");
    }
    let wanted: Vec<(&str, &str)> = WANTED.lines().filter_map(pin).collect();
    assert!(wanted.iter().any(|(name, _)| *name == "mujoco"), "requirements.in pins no MuJoCo");
    for package in wanted {
        let pinned = packages.iter().any(|(p, _)| *p == package);
        assert!(pinned, "sim/requirements.txt does not hold {package:?}; requirements.in says how to make it again");
    }
}
