//! The example of a gauge of one's own compiles, runs, and centres its ball.

#[allow(dead_code)]
#[path = "../examples/own_gauge.rs"]
mod own_gauge;

#[test]
fn the_example_centres_its_ball() {
    // What it asks for is 1 um.
    assert!(own_gauge::centre_with_own_gauge().expect("it centres") < 1e-6);
    own_gauge::main().expect("it ends well");
}
