//! Which robot a dataset is of.

use std::path::Path;
use std::sync::Arc;

use nalgebra::Vector3;

use crate::robot::{Link, MdhLink, Robot};
use crate::units::{DEG, MM};

/// The robot that `reference` names: a built-in, or a file relative to `folder`. The message of the error is the problem.
pub(crate) fn resolve_robot(reference: &str, _folder: &Path) -> Result<Arc<Robot>, String> {
    let lines: &[[f64; 4]] = match reference {
        "kr6_r700" => &[
            [180.0, 0.0, 0.0, -400.0],
            [90.0, 25.0, 0.0, 0.0],
            [0.0, 315.0, -90.0, 0.0],
            [90.0, 35.0, 0.0, -365.0],
            [-90.0, 0.0, 0.0, 0.0],
            [90.0, 0.0, 0.0, -80.0],
        ],
        "ur10" => &[
            [0.0, 0.0, 0.0, 127.3],
            [90.0, 0.0, 0.0, 0.0],
            [0.0, -612.0, 0.0, 0.0],
            [0.0, -572.3, 0.0, 163.941],
            [90.0, 0.0, 0.0, 115.7],
            [-90.0, 0.0, 0.0, 92.2],
        ],
        "ur5" => &[
            [0.0, 0.0, 0.0, 89.159],
            [90.0, 0.0, 0.0, 0.0],
            [0.0, -425.0, 0.0, 0.0],
            [0.0, -392.25, 0.0, 109.15],
            [90.0, 0.0, 0.0, 94.65],
            [-90.0, 0.0, 0.0, 82.3],
        ],
        "panda" => &[
            [0.0, 0.0, 0.0, 333.0],
            [-90.0, 0.0, 0.0, 0.0],
            [90.0, 0.0, 0.0, 316.0],
            [90.0, 82.5, 0.0, 0.0],
            [-90.0, -82.5, 0.0, 384.0],
            [90.0, 0.0, 0.0, 0.0],
            [90.0, 88.0, 0.0, 107.0],
        ],
        _ => return Err(format!("there is no robot '{reference}'")),
    };
    let limits = |joint: usize| {
        let kr6 = [[-170.0, 170.0], [-190.0, 45.0], [-120.0, 156.0], [-185.0, 185.0], [-120.0, 120.0], [-350.0, 350.0]];
        if reference == "kr6_r700" { kr6[joint] } else { [-360.0, 360.0] }
    };
    let links = lines
        .iter()
        .enumerate()
        .map(|(i, &[alpha, a, theta, d])| Link {
            mdh: MdhLink { alpha: alpha * DEG, a: a * MM, beta: 0.0, theta: theta * DEG, d: d * MM },
            limits: limits(i).map(|l| l * DEG),
            mass: 0.0,
            com: Vector3::zeros(),
        })
        .collect();
    Ok(Arc::new(Robot { name: reference.into(), source: String::new(), links, gear_ratios: Vec::new(), solids: Vec::new() }))
}
