//! However small the errors, the classes of their histogram have different edges as printed, and a line fits a terminal.

use calibench::identify::Prediction;
use calibench::nalgebra::Vector3;
use calibench::residuals::Validation;
use calibench_report::histogram;

/// The histogram of twenty errors up to `largest`, m.
fn printed(largest: f64) -> String {
    let prediction = Prediction {
        sample_ids: Vec::new(),
        residuals: (1..=20).map(|k| Vector3::new(0.0, largest * f64::from(k) / 20.0, 0.0)).collect(),
        orientations: Vec::new(),
        refitted: Vec::new(),
        from_fit_rows: Vec::new(),
    };
    histogram(&Validation::of(&prediction).unwrap(), 12)
}

#[test]
fn edges_differ_at_the_digits_printed() {
    for largest in [3e-3, 1e-5, 2e-6, 3e-8] {
        let text = printed(largest);
        let edges =
            |line: &str| line.split(" mm").next().unwrap().split(" - ").map(|e| e.trim().to_owned()).collect::<Vec<_>>();
        for line in text.lines() {
            let edges = edges(line);
            assert!(edges.len() == 2 && edges[0] != edges[1], "{line}");
            assert!(line.chars().count() < 80, "{line}");
        }
        assert_eq!(text.lines().count(), 12, "{text}");
    }
    // Where three digits tell the edges apart, they are those of old.
    assert!(printed(3e-3).starts_with(" 0.000 -  0.250 mm "), "{}", printed(3e-3));
    // Without any error there is one class.
    assert_eq!(printed(0.0).lines().count(), 1);
}
