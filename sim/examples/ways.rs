use calibench::measure::*;
use calibench::units::*;
use calibench_sim::scenario::load_scenario;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let scenario = load_scenario(std::path::Path::new(&path)).unwrap();
    let seed: u64 = std::env::args().nth(2).map_or(1, |s| s.parse().unwrap());
    let t = std::time::Instant::now();
    let plan = calibench_sim::planning::plan(&scenario, seed).unwrap();
    println!("plan {:.2} s", t.elapsed().as_secs_f64());
    let cell = scenario.dataset();
    let surroundings = scenario.surroundings();
    let request = WayRequest {
        robot: &cell.robot,
        base: &cell.base,
        tool: &cell.tool,
        surroundings: &surroundings,
        margin: WAY_MARGIN,
        seed,
    };
    let poses = &plan.probings;
    let approaches: Vec<Vec<f64>> = poses.iter().map(|p| p.approach.clone()).collect();
    let t = std::time::Instant::now();
    let home = home_posture(&request, &approaches).unwrap();
    println!("home {:?} {:.2} s", home.iter().map(|q| (q / DEG).round()).collect::<Vec<_>>(), t.elapsed().as_secs_f64());
    let mut finder = WayFinder::new(request, home.clone());
    let bodies: Vec<Option<usize>> = cell.balls.iter().map(|b| finder.fixed_named(&format!("ball {}", b.id))).collect();
    let t = std::time::Instant::now();
    let mut direct_hits = 0;
    let mut under = 0;
    let main: Vec<&PlannedPose> = poses.iter().filter(|p| !p.reserve).collect();
    for pair in main.windows(2) {
        let n = finder.narrowest(&pair[0].approach, &pair[1].approach, None).unwrap();
        if n.clearance.distance <= 0.0 {
            direct_hits += 1;
        }
        if n.clearance.distance <= 0.008 {
            under += 1;
        }
    }
    let dt = t.elapsed().as_secs_f64();
    println!(
        "direct hits {direct_hits}, under {under} of {}; {:.3} ms each",
        main.len() - 1,
        1e3 * dt / (main.len() - 1) as f64
    );
    let mut least: f64 = 1.0;
    let mut least_c: f64 = 1.0;
    for p in poses {
        let c = finder.narrowest(&p.approach, &p.contact, bodies[p.ball]).unwrap();
        least = least.min(c.clearance.distance);
        let c = finder.narrowest(&p.approach, &p.approach, None).unwrap();
        least_c = least_c.min(c.clearance.distance);
    }
    println!("least on approaches {:.2} mm; at approach without exception {:.2} mm", least / MM, least_c / MM);
    let t = std::time::Instant::now();
    let ways: Vec<Result<Way, Blocked>> = poses.iter().map(|p| finder.home_from(&p.approach)).collect();
    let not_direct = ways.iter().filter(|w| w.as_ref().is_ok_and(|w| !w.via.is_empty())).count();
    let none = ways.iter().filter(|w| w.is_err()).count();
    println!("ways home of {}: {not_direct} by via, {none} none; {:.2} s", ways.len(), t.elapsed().as_secs_f64());
    let t = std::time::Instant::now();
    let mut times = [0.0; 3];
    let len = |path: &[Vec<f64>]| {
        path.windows(2)
            .map(|l| l[0].iter().zip(&l[1]).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / (100.0 * DEG) + 0.3)
            .sum::<f64>()
    };
    let mut fails = 0;
    let mut vias = 0;
    for k in 1..main.len() {
        let (a, b) = (main[k - 1], main[k]);
        let (i, j) = (poses.iter().position(|p| p.id == a.id).unwrap(), poses.iter().position(|p| p.id == b.id).unwrap());
        times[0] += len(&[a.approach.clone(), b.approach.clone()]);
        times[1] += len(&[a.approach.clone(), home.clone(), b.approach.clone()]);
        let (Ok(wa), Ok(wb)) = (&ways[i], &ways[j]) else {
            fails += 1;
            continue;
        };
        match finder.between((&a.approach, wa), (&b.approach, wb)) {
            Ok(w) => {
                vias += usize::from(!w.via.is_empty());
                let path = [&[a.approach.clone()], w.via.as_slice(), &[b.approach.clone()]].concat();
                times[2] += len(&path);
            }
            Err(e) => {
                fails += 1;
                println!("{} -> {}: {e}", a.id, b.id)
            }
        }
    }
    println!(
        "between: {vias} by via, {fails} fail; {:.2} s; times direct {:.0} home {:.0} ways {:.0} s",
        t.elapsed().as_secs_f64(),
        times[0],
        times[1],
        times[2]
    );
}
