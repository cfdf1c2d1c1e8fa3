//! In the paper's cell the pool holds a thousand postures of each ball; every one is on its ball, inside the limits, off
//! singularities and free, and so is its approach; and the same seed gives the same pool on any number of threads.

use calibench::measure::poses::free_poses::{Facing, FreePosesRequest, free_poses};
use calibench::measure::poses::pool::{Margins, PoolError, PoolRequest, ProbedBall, feasible_pool};
use calibench::robot::inverse::dexterity;
use calibench::robot::kinematics::{Posture, world_from_tool};
use calibench::robot::sites::SiteIndex;
use calibench::robot::solids::{Solid, Surroundings, clearance};
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM};
use nalgebra::{Unit, Vector3};

/// Paper Table 8, nominal.
const BASE: FramePose = FramePose { xyz: [-536.320 * MM, -21.901 * MM, -58.349 * MM], rz_ry_rx: [0.0; 3] };
/// The three indicators symmetric about the flange's axis: (1, 1, 1) looks away from the flange.
const TOOL: FramePose = FramePose { xyz: [60.0 * MM, 0.0, -125.0 * MM], rz_ry_rx: [-30.0 * DEG, 35.26439 * DEG, -135.0 * DEG] };
/// Paper Table 1, mm.
const BALLS: [[f64; 3]; 4] =
    [[-79.539, -330.141, 17.531], [-79.193, 287.805, 18.740], [-79.650, -21.958, 276.388], [26.379, -21.676, 170.489]];
const TABLE: f64 = -58.349;
const APPROACH: f64 = 60.0 * MM;

fn point(mm: [f64; 3]) -> Vector3<f64> {
    Vector3::from(mm) * MM
}

fn retreat() -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::repeat(-1.0))
}

/// Table, and under each ball a stem on a riser block; the TriCal as a body and three indicators.
fn surroundings() -> Surroundings {
    let mut fixed = vec![Solid::cuboid("table", 0, point([0.0, 0.0, TABLE - 25.0]), point([1000.0, 1000.0, 25.0]))];
    for (k, ball) in BALLS.iter().enumerate() {
        let [x, y, z] = *ball;
        fixed.push(Solid::capsule(format!("ball {}", k + 1), 0, [point(*ball); 2], 12.7 * MM));
        fixed.push(Solid::capsule(format!("stem {}", k + 1), 0, [point([x, y, z - 15.0]), point([x, y, z - 40.0])], 4.0 * MM));
        let height = (z - 40.0 - TABLE) / 2.0;
        fixed.push(Solid::cuboid(format!("riser {}", k + 1), 0, point([x, y, TABLE + height]), point([20.0, 20.0, height])));
    }
    let flange_from_tool = TOOL.pose();
    let mut carried = vec![Solid::capsule("TriCal body", 6, [point([0.0, 0.0, -25.0]), point([45.0, 0.0, -45.0])], 25.0 * MM)];
    for k in 0..3 {
        let along = |mm: f64| (flange_from_tool * nalgebra::Point3::from(-Vector3::ith(k, mm * MM))).coords;
        carried.push(Solid::capsule(format!("indicator {}", k + 1), 6, [along(25.0), along(90.0)], 8.0 * MM));
    }
    Surroundings { fixed, carried }
}

fn balls() -> Vec<ProbedBall> {
    let ball = |(k, mm): (usize, &[f64; 3])| ProbedBall {
        id: format!("{}", k + 1),
        centre: point(*mm),
        outward: Vector3::z_axis(),
        body: Some(format!("ball {}", k + 1)),
    };
    BALLS.iter().enumerate().map(ball).collect()
}

fn request<'a>(robot: &'a Robot, balls: &'a [ProbedBall], surroundings: &'a Surroundings, count: usize) -> PoolRequest<'a> {
    PoolRequest {
        robot,
        base: &BASE,
        tool: &TOOL,
        balls,
        approach: retreat(),
        approach_length: APPROACH,
        cone: 70.0 * DEG,
        surroundings,
        margins: Margins::default(),
        count_per_ball: count,
        seed: 1,
    }
}

#[test]
fn a_thousand_postures_of_each_ball() {
    let (robot, balls, surroundings) = (built_in("kr6_r700").unwrap(), balls(), surroundings());
    let request = request(&robot, &balls, &surroundings, 1000);
    let start = std::time::Instant::now();
    let pool = feasible_pool(&request).unwrap();
    println!("4 x 1000 postures in {:.2} s", start.elapsed().as_secs_f64());
    assert_eq!(pool.len(), 4000);
    let mut posture = Posture::new(&robot);
    let none = vec![0.0; SiteIndex::new(6).len()];
    for candidate in &pool {
        let at_ball = world_from_tool(&robot, &BASE, &TOOL, &candidate.q);
        let ball = &balls[candidate.ball];
        assert!((at_ball.translation.vector - ball.centre).norm() < 1e-12, "on the ball");
        let backwards = at_ball.rotation * retreat().into_inner();
        assert!(backwards.angle(&ball.outward) < 70.0 * DEG + 1e-9, "inside the cone");
        let away = world_from_tool(&robot, &BASE, &TOOL, &candidate.q_approach);
        assert!((away.translation.vector - ball.centre - backwards * APPROACH).norm() < 1e-10, "straight back");
        let without_ball = Surroundings {
            fixed: surroundings.fixed.iter().filter(|s| Some(&s.name) != ball.body.as_ref()).cloned().collect(),
            carried: surroundings.carried.clone(),
        };
        assert_eq!(robot.outside_limits(&candidate.q, -request.margins.limit), None);
        assert_eq!(robot.outside_limits(&candidate.q_approach, 0.0), None);
        for q in [&candidate.q, &candidate.q_approach] {
            posture.set(&robot, &BASE, &TOOL, q, &none);
            let gap = clearance(&robot, &posture, &without_ball).unwrap();
            assert!(gap.distance >= request.margins.clearance - 1e-9, "{gap:?}");
        }
        posture.set(&robot, &BASE, &TOOL, &candidate.q, &none);
        assert!(dexterity(&posture, 6) >= request.margins.dexterity);
    }
}

#[test]
fn the_pool_does_not_depend_on_the_threads() {
    let (robot, balls, surroundings) = (built_in("kr6_r700").unwrap(), balls(), surroundings());
    let request = request(&robot, &balls, &surroundings, 100);
    let on = |threads: usize| {
        let threads = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        threads.install(|| feasible_pool(&request).unwrap())
    };
    let alone = on(1);
    assert_eq!(alone, on(3));
    assert_ne!(alone, feasible_pool(&PoolRequest { seed: 2, ..request }).unwrap());
    // Fewer wanted are the first of more.
    let fewer = feasible_pool(&PoolRequest { count_per_ball: 30, ..request }).unwrap();
    assert_eq!(fewer[..30], alone[..30]);
}

#[test]
fn a_ball_that_cannot_be_probed_is_named() {
    let (robot, mut balls, surroundings) = (built_in("kr6_r700").unwrap(), balls(), surroundings());
    balls[1].centre.x = 5.0;
    let error = feasible_pool(&request(&robot, &balls, &surroundings, 10)).unwrap_err();
    let PoolError::NoPose { ball, tried, because } = &error else { panic!("{error}") };
    assert_eq!((ball.as_str(), because.reach), ("2", *tried));
    // Inside the table everything touches.
    balls[1].centre = point([-79.193, 287.805, TABLE - 20.0]);
    let error = feasible_pool(&request(&robot, &balls, &surroundings, 10)).unwrap_err();
    assert!(matches!(&error, PoolError::NoPose { ball, because, .. } if ball == "2" && because.touching > 0), "{error}");
    balls[1].body = Some("bull 2".into());
    let error = feasible_pool(&request(&robot, &balls, &surroundings, 10)).unwrap_err();
    assert!(matches!(&error, PoolError::UnknownBody { body, .. } if body == "bull 2"), "{error}");
}

#[test]
fn free_postures_face_the_tracker() {
    let (robot, surroundings) = (built_in("kr6_r700").unwrap(), surroundings());
    let tracker = Vector3::new(3.0, 0.5, 1.0);
    let facing = Facing { looks: Unit::new_normalize(Vector3::repeat(1.0)), tracker, within: 30.0 * DEG };
    let request = FreePosesRequest {
        robot: &robot,
        base: &BASE,
        tool: &TOOL,
        surroundings: &surroundings,
        margins: Margins::default(),
        facing: Some(facing),
        count: 500,
        seed: 7,
    };
    let poses = free_poses(&request).unwrap();
    assert_eq!(poses.len(), 500);
    let mut posture = Posture::new(&robot);
    let none = vec![0.0; SiteIndex::new(6).len()];
    for q in &poses {
        assert_eq!(robot.outside_limits(q, -request.margins.limit), None);
        let pose = world_from_tool(&robot, &BASE, &TOOL, q);
        let angle = (pose.rotation * Vector3::repeat(1.0)).angle(&(tracker - pose.translation.vector));
        assert!(angle < 30.0 * DEG + 1e-9);
        posture.set(&robot, &BASE, &TOOL, q, &none);
        assert!(clearance(&robot, &posture, &surroundings).unwrap().distance >= request.margins.clearance - 1e-9);
    }
    assert_eq!(poses[..50], free_poses(&FreePosesRequest { count: 50, ..request }).unwrap()[..]);
    let away = Facing { within: 0.0, ..facing };
    let error = free_poses(&FreePosesRequest { facing: Some(away), ..request }).unwrap_err();
    assert!(matches!(error, PoolError::NoFreePose { because, .. } if because.facing > 0));
}

#[test]
fn an_arm_without_closed_form_has_a_pool_too() {
    let robot = built_in("panda").unwrap();
    let nothing = Surroundings::default();
    let ball = ProbedBall { id: "1".into(), centre: Vector3::new(0.45, 0.1, 0.2), outward: Vector3::z_axis(), body: None };
    let base = FramePose::default();
    let tool = FramePose { xyz: [0.03, 0.0, 0.12], rz_ry_rx: [0.0; 3] };
    let request = PoolRequest {
        base: &base,
        tool: &tool,
        approach: -Vector3::z_axis(),
        cone: 45.0 * DEG,
        ..request(&robot, std::slice::from_ref(&ball), &nothing, 50)
    };
    let pool = feasible_pool(&request).unwrap();
    assert_eq!(pool.len(), 50);
    for candidate in pool {
        let at_ball = world_from_tool(&robot, &base, &tool, &candidate.q);
        assert!((at_ball.translation.vector - ball.centre).norm() < 1e-10);
    }
}
