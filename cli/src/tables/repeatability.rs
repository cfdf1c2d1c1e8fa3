//! Output of `cell repeatability`.

use calibench::residuals::{LostMotion, PoseRepeatability, StationRepeatability};
use calibench::units::{MM, UM, URAD};
use calibench_report::{Printout, Table, plain_table};
use serde_json::{Value, json};

use calibench_sim::repeatability::Visited;

/// Identification of the robot.
pub struct Whose<'a> {
    /// In a sentence: "scenario 'paper'".
    pub name: String,
    /// In the document: the keys that identify it.
    pub keys: Vec<(&'static str, Value)>,
    /// Names of the balls.
    pub balls: &'a [String],
}

/// p-value below which stations are said to differ: one false alarm per hundred joints whose lost motion is the same
/// everywhere.
const DIFFERENT: f64 = 0.01;

/// Repeatability by station, lost motion by joint, each with its 95 % interval.
pub fn repeatability_text(whose: &Whose<'_>, visited: &Visited) -> Printout {
    let found = &visited.repeatability;
    let time: f64 = visited.records.iter().map(|r| r.duration_s).sum();
    let returns = found.stations.first().map_or(0, |s| s.attained.count);
    let title = format!(
        "Repeatability of the robot of {} by the gauge: {returns} returns to each of {} postures, {:.0} min of cell time\n\n\
         RP after ISO 9283 (mean distance from the barycentre and three standard deviations), um, 95 % interval in brackets\n",
        whose.name,
        found.stations.len(),
        time / 60.0,
    );
    let mut out = Printout::from(title) + stations_table(whose.balls, &found.stations);
    out.push(
        "\nattained: back at the same joints from one side. unseen: the part that the encoders do not see.\n\
         probing: of one centring, by encoders and readings. gauge: the readings alone, nothing moving; it is in all three.\n\n\
         Lost motion: angle after moving up less angle after moving down, beyond what the encoders see, 95 % interval in brackets\n",
    );
    out + joints_table(&found.lost_motion) + "\n" + agreement(&found.lost_motion)
}

fn stations_table(balls: &[String], stations: &[StationRepeatability]) -> Table {
    let rows: Vec<[String; 6]> = stations
        .iter()
        .map(|s| {
            let [attained, unseen, probing, gauge] = [&s.attained, &s.unseen, &s.probing, &s.gauge].map(rp_text);
            [s.id.clone(), balls[s.ball].clone(), attained, unseen, probing, gauge]
        })
        .collect();
    plain_table(["posture", "ball", "attained", "unseen", "probing", "gauge"], rows)
}

fn rp_text(found: &PoseRepeatability) -> String {
    let [low, high] = found.interval.map(|v| v / UM);
    format!("{:.1} ({low:.1} to {high:.1})", found.rp / UM)
}

fn joints_table(joints: &[LostMotion]) -> Table {
    let rows: Vec<[String; 5]> = joints
        .iter()
        .map(|j| {
            let [low, high] = j.interval.map(|v| v / URAD);
            let reversal = format!("{:+.1} ({low:+.1} to {high:+.1})", j.reversal / URAD);
            let verdict = if low * high > 0.0 { "shown" } else { "not shown" };
            let lever = format!("{:.0}", j.lever / MM);
            [(j.joint + 1).to_string(), reversal, lever, format!("{:.1}", most_at_tcp(j) / UM), verdict.into()]
        })
        .collect();
    plain_table(["joint", "reversal, µrad", "lever, mm", "at the TCP at most, µm", ""], rows)
}

/// Largest TCP error of a target approached from the other side, at the joint's longest lever, m, from the far end of the
/// interval.
fn most_at_tcp(joint: &LostMotion) -> f64 {
    joint.interval.iter().fold(0.0, |most: f64, end| most.max(end.abs())) * joint.lever
}

/// Names the joints whose lost motion differs between postures.
fn agreement(joints: &[LostMotion]) -> String {
    let differ = joints.iter().filter(|j| j.alike_p.is_some_and(|p| p < DIFFERENT));
    let named: Vec<String> = differ.map(|j| (j.joint + 1).to_string()).collect();
    match named.as_slice() {
        [] if joints.iter().all(|j| j.alike_p.is_none()) => {
            "One posture: whether a joint loses the same elsewhere is not known.".into()
        }
        [] => "No joint is seen to lose more at one posture than at another (chance 1 %).".into(),
        named => format!(
            "The postures do not agree (chance 1 %) on joint {}: it loses by load or place, and its number is a mean over these postures.",
            named.join(", ")
        ),
    }
}

fn rp_json(found: &PoseRepeatability) -> Value {
    json!({"count": found.count, "mean_um": found.mean / UM, "std_um": found.deviation / UM, "rp_um": found.rp / UM,
        "interval_um": found.interval.map(|v| v / UM)})
}

/// The same as one document, `calibench-repeatability/1`.
pub fn repeatability_json(whose: &Whose<'_>, visited: &Visited) -> Value {
    let stations: Vec<Value> = visited
        .repeatability
        .stations
        .iter()
        .zip(&visited.records)
        .map(|(s, record)| {
            json!({"id": s.id, "ball": whose.balls[s.ball], "attained": rp_json(&s.attained), "unseen": rp_json(&s.unseen),
                "probing": rp_json(&s.probing), "gauge": rp_json(&s.gauge), "duration_s": record.duration_s})
        })
        .collect();
    let joints: Vec<Value> = visited
        .repeatability
        .lost_motion
        .iter()
        .map(|j| {
            json!({"joint": j.joint + 1, "reversal_urad": j.reversal / URAD, "interval_urad": j.interval.map(|v| v / URAD),
                "reversals": j.count, "lever_mm": j.lever / MM, "at_tcp_at_most_um": most_at_tcp(j) / UM, "alike_p": j.alike_p})
        })
        .collect();
    let mut document =
        json!({"format": "calibench-repeatability/1", "confidence": 0.95, "stations": stations, "lost_motion": joints});
    whose.keys.iter().for_each(|(key, value)| document[*key] = value.clone());
    document
}
