//! A candidate artifact: the balls that stay, the places of the others, its mass, and the scenario that contains it.

use calibench::files::FileError;
use calibench::units::MM;
use serde::Serialize;
use toml::{Table, Value};

use calibench_sim::contact::DATUM_RADIUS;
use calibench_sim::scenario::{DesignToml, Document, KeyError, Scenario};

/// A place where a ball may be: vertically above a riser block.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Place {
    /// Centre of the ball in the world, mm.
    pub centre_mm: [f64; 3],
    /// From the table to the top of the block, mm.
    pub riser_mm: f64,
}

/// An artifact: balls of the scenario that stay, by index, and balls that are added.
#[derive(Debug, Clone, PartialEq)]
pub struct Artifact {
    /// Balls of the scenario that stay where they are.
    pub kept: Vec<usize>,
    /// Places of the other balls.
    pub placed: Vec<Place>,
}

/// Components of artifacts, and the cell without them.
pub struct Workshop {
    /// The scenario as it is.
    pub document: Document,
    /// The scenario, parsed.
    pub scenario: Scenario,
    /// The design request.
    pub design: DesignToml,
    /// Balls of the scenario that stay, by index.
    pub kept: Vec<usize>,
}

impl Workshop {
    /// Opens the workshop for the scenario's `[design]`.
    ///
    /// # Errors
    /// If the scenario is invalid, or has no valid `[design]`.
    pub fn open(document: &Document) -> Result<Self, FileError> {
        let scenario = document.scenario()?;
        scenario.expect_trical("sim design")?;
        let Some(design) = scenario.design.clone() else {
            let remedy = "say in [design] how many balls, where, and of what the artifact is made";
            return Err(document.wrong("design", "is missing", remedy));
        };
        let ids = scenario.ball_ids();
        let kept: Vec<usize> = design.fixed.iter().filter_map(|id| ids.iter().position(|b| b == id)).collect();
        if !kept.is_empty() && !design.scales.is_empty() {
            let remedy = "leave out `fixed`, or `scales`";
            return Err(document.wrong("design.scales", "an artifact with fixed balls has its size", remedy));
        }
        let workshop = Workshop { document: document.clone(), scenario, design, kept };
        if let Some(name) = workshop.design.without.iter().find(|name| !workshop.has_solid(name)) {
            return Err(document.wrong("design.without", format!("there is no solid '{name}'"), "name bodies of [[solid]]"));
        }
        Ok(workshop)
    }

    /// An artifact of only the balls that stay.
    pub fn all_kept(&self) -> Artifact {
        Artifact { kept: self.kept.clone(), placed: Vec::new() }
    }

    /// Every place of the grid: row by row from the lowest corner of the box, lowest riser first.
    pub fn grid(&self) -> Vec<Place> {
        let DesignToml { min_mm, max_mm, step_mm, riser_heights_mm, table_mm, stem_mm, .. } = &self.design;
        let [columns, rows] = self.design.columns();
        let mut places = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let [x, y] = [min_mm[0] + column as f64 * step_mm, min_mm[1] + row as f64 * step_mm];
                for &riser_mm in riser_heights_mm {
                    let z = table_mm + riser_mm + stem_mm;
                    if (min_mm[2]..=max_mm[2]).contains(&z) {
                        places.push(Place { centre_mm: [x, y, z], riser_mm });
                    }
                }
            }
        }
        places
    }

    /// True if a ball at that place lies in the box scaled by `scale`: horizontally about its centre line, vertically from the
    /// table up.
    pub fn is_within(&self, place: &Place, scale: f64) -> bool {
        let DesignToml { min_mm, max_mm, table_mm, .. } = &self.design;
        let inside = |i: usize| {
            let (middle, half) = ((min_mm[i] + max_mm[i]) / 2.0, (max_mm[i] - min_mm[i]) / 2.0);
            (place.centre_mm[i] - middle).abs() <= scale * half + 1e-9
        };
        inside(0) && inside(1) && place.centre_mm[2] - table_mm <= scale * (max_mm[2] - table_mm) + 1e-9
    }

    /// True if the blocks under two places do not overlap.
    pub fn go_together(&self, one: &Place, other: &Place) -> bool {
        (0..2).any(|i| (one.centre_mm[i] - other.centre_mm[i]).abs() >= self.design.riser_side_mm)
    }

    /// True if block, stem and ball at a place are clear of everything in the scenario except the table under them.
    pub fn is_free(&self, place: &Place, kept: &[usize]) -> bool {
        let half = self.design.riser_side_mm / 2.0;
        let [x, y, z] = place.centre_mm;
        let own = [[x - half, y - half, self.design.table_mm], [x + half, y + half, z + DATUM_RADIUS / MM]];
        let apart = |other: &[[f64; 3]; 2]| (0..3).any(|i| own[1][i] <= other[0][i] || other[1][i] <= own[0][i]);
        let solids = self.standing(kept);
        let ball = |&b: &usize| {
            let (at, r) = (self.scenario.dataset().balls[b].position / MM, DATUM_RADIUS / MM);
            [[at.x - r, at.y - r, at.z - r], [at.x + r, at.y + r, at.z + r]]
        };
        solids.iter().filter_map(extent).all(|e| apart(&e)) && kept.iter().map(ball).all(|e| apart(&e))
    }

    /// Mass of an artifact, kg: blocks, stems with balls, and a plate under the rectangle that the blocks span.
    pub fn mass_kg(&self, artifact: &Artifact) -> f64 {
        let DesignToml { plate_kg_per_m2, riser_kg, riser_kg_per_m, ball_kg, .. } = &self.design;
        let places = self.on_risers(artifact);
        let risers: f64 = places.iter().map(|p| riser_kg + riser_kg_per_m * p.riser_mm * MM).sum();
        let [length, width, _] = self.size_mm(artifact);
        risers + plate_kg_per_m2 * length * MM * width * MM + ball_kg * (artifact.kept.len() + artifact.placed.len()) as f64
    }

    /// Overall length along x, width along y and height of an artifact, mm.
    pub fn size_mm(&self, artifact: &Artifact) -> [f64; 3] {
        let half = self.design.riser_side_mm / 2.0;
        let radius = DATUM_RADIUS / MM;
        let mut low = [f64::INFINITY; 2];
        let (mut high, mut top) = ([f64::NEG_INFINITY; 2], f64::NEG_INFINITY);
        let mut take = |centre: [f64; 3], reach: f64| {
            for i in 0..2 {
                low[i] = low[i].min(centre[i] - reach);
                high[i] = high[i].max(centre[i] + reach);
            }
            top = top.max(centre[2] + radius);
        };
        self.on_risers(artifact).iter().for_each(|p| take(p.centre_mm, half));
        artifact.kept.iter().for_each(|&b| take(self.centre_mm(b), radius));
        [high[0] - low[0], high[1] - low[1], top - self.design.table_mm]
    }

    /// Names and centres of all balls, mm, those kept first.
    pub fn balls(&self, artifact: &Artifact) -> Vec<(String, [f64; 3])> {
        let ids = self.scenario.ball_ids();
        let kept = artifact.kept.iter().map(|&b| (ids[b].clone(), self.centre_mm(b)));
        kept.chain(self.names(artifact).into_iter().zip(artifact.placed.iter().map(|p| p.centre_mm))).collect()
    }

    /// The scenario with this artifact in place of its own, and `poses_per_ball` probings per ball.
    ///
    /// # Errors
    /// If the resulting scenario is invalid.
    pub fn document(&self, artifact: &Artifact, poses_per_ball: usize) -> Result<Document, FileError> {
        let mut document = self.document.clone();
        let listed = |name: &str| {
            let value = name.parse().ok().and_then(|key| self.document.get(&key)).and_then(Value::as_array);
            value.cloned().unwrap_or_default()
        };
        let old = listed("ball");
        let mut balls: Vec<Value> = artifact.kept.iter().map(|&b| old[b].clone()).collect();
        let sigma = old[0].get("sigma_um").cloned();
        let mut solids: Vec<Value> = self.standing(&artifact.kept).into_iter().map(Value::Table).collect();
        for (id, place) in self.names(artifact).iter().zip(&artifact.placed) {
            let [x, y, z] = place.centre_mm;
            let mut ball = table([("id", id.as_str().into()), ("x_mm", x.into()), ("y_mm", y.into()), ("z_mm", z.into())]);
            if let Some(sigma) = &sigma {
                ball.insert("sigma_um".into(), sigma.clone());
            }
            ball.insert("outward".into(), vector([0.0, 0.0, 1.0]));
            balls.push(Value::Table(ball));
            solids.extend(self.bodies(id, place).map(Value::Table));
        }
        for (key, value) in [
            ("ball", Value::Array(balls)),
            ("solid", Value::Array(solids)),
            ("plan.poses_per_ball", Value::Integer(poses_per_ball as i64)),
        ] {
            let put = key.parse().and_then(|key| document.set(&key, value));
            put.map_err(|e: KeyError| self.document.wrong(key, e.to_string(), "let the scenario have it"))?;
        }
        Ok(document)
    }

    /// All places on riser blocks: those of the added balls, and of kept balls with an upright stem; a ball on a stem from the
    /// side has none.
    fn on_risers(&self, artifact: &Artifact) -> Vec<Place> {
        let upright = |&&b: &&usize| self.scenario.outward()[b].z > 0.99;
        let kept = artifact.kept.iter().filter(upright).map(|&b| {
            let centre_mm = self.centre_mm(b);
            Place { centre_mm, riser_mm: (centre_mm[2] - self.design.table_mm - self.design.stem_mm).max(0.0) }
        });
        kept.chain(artifact.placed.iter().copied()).collect()
    }

    fn centre_mm(&self, ball: usize) -> [f64; 3] {
        (self.scenario.dataset().balls[ball].position / MM).into()
    }

    /// Names for the added balls: the lowest unused numbers.
    fn names(&self, artifact: &Artifact) -> Vec<String> {
        let ids = self.scenario.ball_ids();
        let taken = |name: &String| artifact.kept.iter().any(|&b| ids[b] == *name);
        (1..).map(|n: usize| n.to_string()).filter(|name| !taken(name)).take(artifact.placed.len()).collect()
    }

    /// The bodies of the scenario, as in the file.
    fn solids(&self) -> impl Iterator<Item = &Table> {
        let solids = "solid".parse().ok().and_then(|key| self.document.get(&key)).and_then(Value::as_array);
        solids.into_iter().flatten().filter_map(Value::as_table)
    }

    /// True if the scenario has a body of that name.
    pub fn has_solid(&self, name: &str) -> bool {
        self.solids().any(|s| s.get("name").and_then(Value::as_str) == Some(name))
    }

    /// The bodies that remain in the cell when these balls are kept. Unless all balls are kept, those named in `without` are
    /// removed; if none is kept, everything on the artifact is removed too.
    fn standing(&self, kept: &[usize]) -> Vec<Table> {
        let stays = |solid: &Table| {
            let named = |name: &str| self.design.without.iter().any(|w| w == name);
            let on_artifact = solid.get("on_artifact").and_then(Value::as_bool).unwrap_or(false);
            let all = kept.len() == self.scenario.ball_ids().len();
            all || !(on_artifact && kept.is_empty() || solid.get("name").and_then(Value::as_str).is_some_and(named))
        };
        self.solids().filter(|s| stays(s)).cloned().collect()
    }

    /// Block and stem under a ball.
    fn bodies(&self, id: &str, place: &Place) -> [Table; 2] {
        let DesignToml { riser_side_mm, stem_radius_mm, table_mm, .. } = self.design;
        let ([x, y, z], half, top) = (place.centre_mm, riser_side_mm / 2.0, table_mm + place.riser_mm);
        let body = |name: String| table([("name", name.into()), ("on_artifact", true.into())]);
        let mut riser = body(format!("riser {id}"));
        riser.insert("min_mm".into(), vector([x - half, y - half, table_mm]));
        riser.insert("max_mm".into(), vector([x + half, y + half, top]));
        let mut stem = body(format!("stem {id}"));
        stem.insert("from_mm".into(), vector([x, y, top]));
        // Its round end touches the ball from below.
        stem.insert("to_mm".into(), vector([x, y, (z - DATUM_RADIUS / MM - stem_radius_mm).max(top)]));
        stem.insert("radius_mm".into(), stem_radius_mm.into());
        [riser, stem]
    }
}

fn table<const N: usize>(entries: [(&str, Value); N]) -> Table {
    entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect()
}

fn vector(v: [f64; 3]) -> Value {
    Value::Array(v.map(Value::Float).to_vec())
}

/// Bounding box of a solid as in the file, mm.
fn extent(solid: &Table) -> Option<[[f64; 3]; 2]> {
    let number = |v: &Value| v.as_float().or_else(|| v.as_integer().map(|i| i as f64));
    let read = |key: &str| -> Option<[f64; 3]> {
        let list: Vec<f64> = solid.get(key)?.as_array()?.iter().filter_map(number).collect();
        list.try_into().ok()
    };
    let corners = read("min_mm").zip(read("max_mm"));
    let capsule = read("from_mm").zip(read("to_mm")).zip(solid.get("radius_mm").and_then(number));
    let around = |((from, to), r): (([f64; 3], [f64; 3]), f64)| {
        ([0, 1, 2].map(|i| from[i].min(to[i]) - r), [0, 1, 2].map(|i| from[i].max(to[i]) + r))
    };
    corners.or_else(|| capsule.map(around)).map(|(low, high)| [low, high])
}
