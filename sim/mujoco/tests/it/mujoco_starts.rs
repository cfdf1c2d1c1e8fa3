//! With the feature `mujoco`, MuJoCo starts inside this process in its pinned version, and computes. A failed start fails the
//! test, with the remedy: anyone who builds the feature wants MuJoCo.

use calibench_mujoco::mujoco;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;

/// A mass on a vertical slide, free to fall.
const FALLING: &str = r#"<mujoco><option timestep="0.001" gravity="0 0 -9.81"/><worldbody>
    <body><joint type="slide" axis="0 0 1"/><geom size="0.01" mass="1"/></body>
</worldbody></mujoco>"#;
/// Time step, s.
const STEP: f64 = 1e-3;
/// Gravity of the model, m/s².
const GRAVITY: f64 = 9.81;

/// Tolerance for sums of a thousand equal terms in double precision.
const ROUNDING: f64 = 1e-12;

/// Height and speed, m and m/s, after this many steps.
fn fall(mujoco: &Bound<'_, PyModule>, steps: usize) -> PyResult<(f64, f64)> {
    let model = mujoco.getattr("MjModel")?.call_method1("from_xml_string", (FALLING,))?;
    let data = mujoco.getattr("MjData")?.call1((&model,))?;
    let height = data.getattr("qpos")?.cast_into::<PyArray1<f64>>()?;
    let speed = data.getattr("qvel")?.cast_into::<PyArray1<f64>>()?;
    let step = mujoco.getattr("mj_step")?;
    for _ in 0..steps {
        step.call1((&model, &data))?;
    }
    Ok((height.readonly().as_slice()?[0], speed.readonly().as_slice()?[0]))
}

#[test]
fn a_mass_falls_as_newton_says() {
    Python::attach(|py| {
        let mujoco = mujoco(py).unwrap_or_else(|error| panic!("{error}"));
        println!("Python {}, MuJoCo {}", Python::version_str(), mujoco.getattr("__version__").expect("it has a version"));
        let (height, speed) = fall(&mujoco, 1000).expect("MuJoCo steps");
        // MuJoCo's Euler step uses the new velocity: v = -g h n, z = -g h^2 n (n + 1) / 2.
        let expected = (-GRAVITY * STEP * STEP * 1000.0 * 1001.0 / 2.0, -GRAVITY * STEP * 1000.0);
        assert!((height / expected.0 - 1.0).abs() < ROUNDING, "height {height} m in place of {}", expected.0);
        assert!((speed / expected.1 - 1.0).abs() < ROUNDING, "speed {speed} m/s in place of {}", expected.1);
    });
}
