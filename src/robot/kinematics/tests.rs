use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;
use crate::robot::sites::{Axis6, MdhEntry, Site};
use crate::robot::{Link, MdhLink, rotation_vector};

/// Step of the central difference; its truncation (1e-10 relative) and rounding (1e-11) are both below the tolerance.
const STEP: f64 = 1e-5;
/// Largest difference between a column and its central difference, m or rad per SI unit of the parameter.
const TOLERANCE: f64 = 1e-8;

fn arm(joints: usize, random: &mut ChaCha8Rng) -> Robot {
    let mut between = |low: f64, high: f64| random.random_range(low..high);
    let links = (0..joints)
        .map(|_| Link {
            mdh: MdhLink {
                kind: if between(0.0, 1.0) < 0.3 { JointKind::Prismatic } else { JointKind::Revolute },
                alpha: between(-3.0, 3.0),
                a: between(-0.5, 0.5),
                beta: between(-0.4, 0.4),
                theta: between(-3.0, 3.0),
                d: between(-0.5, 0.5),
            },
            limits: [-3.0, 3.0],
            mass: 1.0,
            com: Vector3::zeros(),
        })
        .collect();
    Robot { name: "random".into(), links, ..Robot::default() }
}

#[test]
fn every_column_is_the_derivative_of_its_site() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for joints in [6, 7] {
        let robot = arm(joints, &mut random);
        let index = SiteIndex::new(joints);
        let mut posture = Posture::new(&robot);
        let mut number = |scale: f64| random.random_range(-scale..scale);
        let base = FramePose::from_array(std::array::from_fn(|_| number(1.0)));
        let tool = FramePose::from_array(std::array::from_fn(|_| number(0.2)));
        let q: Vec<f64> = (0..joints).map(|_| number(3.0)).collect();
        let mut deviations: Vec<f64> = (0..index.len()).map(|_| number(0.3)).collect();
        let mut sites: Vec<Site> = Axis6::ALL.into_iter().map(Site::Base).collect();
        for k in 0..=joints {
            sites.extend(Axis6::ALL.into_iter().map(|axis| Site::flex(k, axis)));
        }
        for i in 0..joints {
            sites.extend(MdhEntry::ALL.into_iter().map(|entry| Site::mdh(i, entry)));
        }
        sites.extend((0..3).map(Site::Tool));
        assert_eq!(sites.len() + 6, index.len(), "all sites but those of target and probe");
        for &site in &sites {
            let place = index.of(site);
            let at = deviations[place];
            let mut pose = |value: f64| {
                deviations[place] = value;
                posture.set(&robot, &base, &tool, &q, &deviations);
                posture.world_from_tool(&tool)
            };
            let (before, after) = (pose(at - STEP), pose(at + STEP));
            pose(at);
            let difference = (after.translation.vector - before.translation.vector) / (2.0 * STEP);
            let column = posture.column(site);
            assert!((column - difference).norm() < TOLERANCE, "{site}: {column:?} against {difference:?}");
            let turned = rotation_vector(&(after.rotation * before.rotation.inverse())) / (2.0 * STEP);
            let axis = posture.turning(site);
            assert!((axis - turned).norm() < TOLERANCE, "{site}: turns about {axis:?}, not {turned:?}");
        }
        let mut together = vec![Vectors::ZERO; index.len()];
        posture.columns(&mut together);
        sites.extend((0..3).map(Site::Target));
        for site in sites.into_iter().filter(|site| !matches!(site, Site::Flex(..))) {
            assert_eq!(together[index.of(site)].at(0), posture.column(site), "{site}");
        }
    }
}

#[test]
fn a_joint_moves_the_tcp_as_its_derivative_says() {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut slides = 0;
    for _ in 0..10 {
        let robot = arm(7, &mut random);
        let mut posture = Posture::new(&robot);
        let mut q: Vec<f64> = (0..7).map(|_| random.random_range(-3.0..3.0)).collect();
        let (base, tool) = (FramePose::default(), FramePose { xyz: [0.1, 0.02, -0.2], rz_ry_rx: [0.3, 0.1, -0.2] });
        let none = vec![0.0; SiteIndex::new(7).len()];
        for i in 0..7 {
            slides += usize::from(robot.kind(i) == JointKind::Prismatic);
            let mut at = |by: f64| {
                q[i] += by;
                posture.set(&robot, &base, &tool, &q, &none);
                assert!(
                    (posture.world_from_tool(&tool).to_homogeneous()
                        - world_from_tool(&robot, &base, &tool, &q).to_homogeneous())
                    .amax()
                        < 1e-13
                );
                q[i] -= by;
                posture.tcp()
            };
            let difference = (at(STEP) - at(-STEP)) / (2.0 * STEP);
            at(0.0);
            assert!((posture.motion(i) - difference).norm() < TOLERANCE);
            assert_eq!(posture.motion(i), posture.column(robot.joint_site(i)));
        }
    }
    assert!(slides > 10, "{slides}");
}

#[test]
fn a_workspace_keeps_nothing_of_the_posture_before() {
    let mut random = ChaCha8Rng::seed_from_u64(2);
    let robot = arm(6, &mut random);
    let index = SiteIndex::new(6);
    let (q, tool) = ([0.3, -0.8, 1.1, 0.4, -0.6, 2.0], FramePose { xyz: [0.1, 0.02, -0.2], rz_ry_rx: [0.0; 3] });
    let with = |site: Site, value: f64| {
        let mut deviations = vec![0.0; index.len()];
        deviations[index.of(site)] = value;
        deviations
    };
    let bases = [[0.1, 0.2, 0.3, 0.0, 0.0, 0.0], [0.1, 0.2, 0.4, 0.0, 0.0, 0.0], [0.1, 0.2, 0.4, 0.5, -0.2, 0.1]];
    let cases = [
        with(Site::flex(3, Axis6::Rz), 0.2),
        with(Site::tool(0), 0.0),
        with(Site::flex(5, Axis6::X), 0.01),
        with(Site::Base(Axis6::Ry), 0.1),
        with(Site::mdh(2, MdhEntry::Beta), 0.1),
    ];
    let mut kept = Posture::new(&robot);
    for base in bases.map(FramePose::from_array) {
        for deviations in &cases {
            let mut fresh = Posture::new(&robot);
            kept.set(&robot, &base, &tool, &[0.0; 6], deviations);
            kept.turn_to(&robot, &q, deviations);
            fresh.set(&robot, &base, &tool, &q, deviations);
            assert_eq!(kept.tcp(), fresh.tcp());
            for k in 0..=6 {
                assert_eq!(kept.frame(k), fresh.frame(k));
                for site in Axis6::ALL.map(|axis| Site::flex(k, axis)).into_iter().chain(Axis6::ALL.map(Site::Base)) {
                    assert_eq!(kept.column(site), fresh.column(site), "{site}");
                }
            }
        }
    }
}

/// Bit for bit: lanes are independent of their neighbours.
#[test]
fn postures_side_by_side_are_those_that_each_has_alone() {
    /// Number of postures computed together.
    const LANES: usize = 8;
    let mut random = ChaCha8Rng::seed_from_u64(3);
    for joints in [1, 6, 7, 9] {
        let robot = arm(joints, &mut random);
        let index = SiteIndex::new(joints);
        let (mut together, mut alone) = (Postures::<LANES>::new(&robot), Posture::new(&robot));
        for round in 0..6 {
            let mut numbers = |count: usize, scale: f64| -> Vec<[f64; LANES]> {
                (0..count).map(|_| std::array::from_fn(|_| random.random_range(-scale..scale))).collect()
            };
            let (base, tool): ([_; 6], [_; 3]) = (numbers(6, 1.0).try_into().unwrap(), numbers(3, 0.2).try_into().unwrap());
            let (mut q, mut deviations) = (numbers(joints, 3.0), numbers(index.len(), 0.3));
            // Beyond the range of the polynomials of sine and cosine, one posture must not decide for the others.
            q[0][3] = 2e6;
            for k in 0..=joints {
                let stiff = |l: usize| round < 2 || (round + k + l).is_multiple_of(3);
                for v in &mut deviations[index.flex(k)..][..6] {
                    (0..LANES).filter(|&l| stiff(l)).for_each(|l| v[l] = 0.0);
                }
            }
            if round == 5 {
                deviations[index.of(Site::mdh(0, MdhEntry::Beta))][2] = -robot.links[0].mdh.beta;
            }
            together.set_all(&robot, &BatchInput { base: &base, tool: &tool, q: &q, deviations: &deviations });
            let (mut columns, mut own) = (vec![Vectors::ZERO; index.len()], vec![Vectors::ZERO; index.len()]);
            together.columns(&mut columns);
            for lane in 0..LANES {
                let of = |list: &[[f64; LANES]]| -> Vec<f64> { list.iter().map(|x| x[lane]).collect() };
                let base = FramePose::from_array(base.map(|x| x[lane]));
                let tool = FramePose { xyz: tool.map(|x| x[lane]), ..FramePose::default() };
                alone.set(&robot, &base, &tool, &of(&q), &of(&deviations));
                let bits = |v: Vector3<f64>| [v.x, v.y, v.z].map(f64::to_bits);
                assert_eq!(bits(together.tcps().at(lane)), bits(alone.tcp()), "{joints} joints, round {round}");
                for k in 0..=joints {
                    let (one, other) = (together.frame_at(lane, k), alone.frame(k));
                    assert_eq!([one.x, one.y, one.z, one.o].map(bits), [other.x, other.y, other.z, other.o].map(bits));
                    for site in Axis6::ALL.map(|axis| Site::flex(k, axis)) {
                        assert_eq!(bits(together.column_at(lane, site)), bits(alone.column(site)), "{site}");
                    }
                }
                alone.columns(&mut own);
                for (column, own) in columns.iter().zip(&own) {
                    assert_eq!(bits(column.at(lane)), bits(own.at(0)));
                }
            }
        }
    }
}
