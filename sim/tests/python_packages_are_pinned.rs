//! Every Python package that is fetched is pinned with hashes: what runs tomorrow is what ran today, byte for byte.

/// What is wanted, what is pinned, and the package that it is all for.
const SETS: [(&str, &str, &str); 6] = [
    (include_str!("../requirements.in"), include_str!("../requirements.txt"), "mujoco"),
    (include_str!("../view/requirements.in"), include_str!("../view/requirements.txt"), "rerun-sdk"),
    (include_str!("../../tests/browser/requirements.in"), include_str!("../../tests/browser/requirements.txt"), "playwright"),
    (include_str!("../dask/requirements.in"), include_str!("../dask/requirements.txt"), "distributed"),
    (include_str!("../../tests/clients/requirements.in"), include_str!("../../tests/clients/requirements.txt"), "pyserial"),
    (include_str!("../../docs/robots/requirements.in"), include_str!("../../docs/robots/requirements.txt"), "scikit-learn"),
];

/// Package and version of a line that pins one.
fn pin(line: &str) -> Option<(&str, &str)> {
    line.trim_end_matches([' ', '\\']).split_once("==").filter(|(name, _)| !name.starts_with([' ', '#']))
}

#[test]
fn what_is_wanted_is_pinned_and_every_pin_has_hashes() {
    for (wanted, pinned, main) in SETS {
        let mut packages: Vec<((&str, &str), usize)> = Vec::new();
        for line in pinned.lines() {
            if let Some(package) = pin(line) {
                packages.push((package, 0));
            } else if line.trim().starts_with("--hash=sha256:") {
                packages.last_mut().expect("a hash stands below its package").1 += 1;
            }
        }
        for (package, hashes) in &packages {
            assert!(*hashes > 0, "{package:?} has no hash");
        }
        let wanted: Vec<(&str, &str)> = wanted.lines().filter_map(pin).collect();
        assert!(wanted.iter().any(|(name, _)| *name == main), "{main} is not wanted");
        for package in wanted {
            let held = packages.iter().any(|(p, _)| *p == package);
            assert!(held, "{package:?} is wanted and not pinned; requirements.in says how to make requirements.txt again");
        }
    }
}
