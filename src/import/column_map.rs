//! Maps from the columns and units of a source table to those of a dataset.

mod keys;

use std::path::Path;

use nalgebra::Vector3;

pub(super) use self::keys::{ColumnName, Source};
use self::keys::{FlangeSource, MapToml, PointSource, RotationSource};
use super::rotation::RotationForm;
use super::row_order::RowOrder;
use super::source::{Join, Layout};
use crate::files::{FileError, field_error, name_remedy, parse_toml};
use crate::measure::dataset::columns::Column;
use crate::measure::dataset::file::Reading;
use crate::measure::dataset::{Dataset, ToolTarget};
use crate::robot::{Pose, Robot};
use crate::units::{DEG, MM, UM};

/// The format this version reads.
const FORMAT: &str = "calibench-import/1";

/// Number of joints of an arm of which a pose determines the joints, but for the choice of its posture.
const SIX: usize = 6;

/// Meaning of a number in the source.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Measure {
    /// A quantity in units of this many SI units.
    Si(f64),
    /// A date and time of day, written yyyymmddhhmmss.
    Timestamp,
}

/// A column of the dataset that a map fills.
#[derive(Debug, Clone)]
pub(super) struct MappedColumn {
    pub column: Column,
    /// Meaning of its number; `None` for text.
    pub measure: Option<Measure>,
    pub source: Source,
}

/// The orientation of the tool in a row.
#[derive(Debug, Clone)]
pub(super) struct MappedRotation {
    pub form: RotationForm,
    /// True if position and orientation are those of the world in the tool.
    pub inverse: bool,
    /// Source of each number of the form.
    pub numbers: Vec<(Source, Measure)>,
}

/// The pose of the flange, from which the joints are computed.
#[derive(Debug, Clone)]
pub(super) struct MappedFlange {
    pub position: [MappedColumn; 3],
    pub rotation: MappedRotation,
    /// The frame of which the pose is stated, in the flange.
    pub tool: Pose,
    /// Joints of the posture in which the rows were measured, rad.
    pub near: Vec<f64>,
}

/// A checked column map.
#[derive(Debug, Clone)]
pub(super) struct ColumnMap {
    pub delimiter: u8,
    pub decimal: char,
    pub header: bool,
    /// Number of lines before the table.
    pub skip_lines: usize,
    pub session_per_file: bool,
    /// Sheet of a workbook; the first that holds a table if `None`.
    pub sheet: Option<String>,
    /// Joins the files side by side to one table.
    pub join: Option<Join>,
    /// Kind of every row, if no column gives it.
    pub kind: String,
    pub columns: Vec<MappedColumn>,
    /// Columns of the position of each further measured point of the tool, by its name.
    pub tool_targets: Vec<(String, [MappedColumn; 3])>,
    /// The orientation, in rows of kind `pose`.
    pub rotation: Option<MappedRotation>,
    /// The pose from which joints are computed, if the table has none.
    pub flange: Option<MappedFlange>,
    /// Information in the order of the rows.
    pub rows: Option<RowOrder>,
    /// Free columns, copied as they are.
    pub extra: Vec<(String, Source)>,
    /// True if the map gives the base.
    pub has_base: bool,
}

impl ColumnMap {
    /// Parses a map and the dataset description that it contains; a robot file is searched for relative to `folder`.
    pub fn parse(path: &Path, text: &str, folder: &Path) -> Result<(ColumnMap, Dataset), FileError> {
        let origin = Origin { path, text };
        let wrong = |key: &str, problem: String, remedy: String| Err(origin.wrong(key, problem, remedy));
        let file: MapToml = parse_toml(path, text)?;
        if file.format != FORMAT {
            return wrong("format", format!("`{}` is not read by this version", file.format), format!("write `{FORMAT}`"));
        }
        let Ok(delimiter) = u8::try_from(file.delimiter) else {
            return wrong(
                "delimiter",
                format!("`{}` cannot separate fields", file.delimiter),
                "use `,`, `;`, a tab, or a space for columns in white space".into(),
            );
        };
        if !matches!(file.decimal, '.' | ',') || file.decimal == file.delimiter {
            return wrong("decimal", format!("`{}` cannot be the decimal sign here", file.decimal), "use `.` or `,`".into());
        }
        if !["ball", "point", "pose", "distance"].contains(&file.kind.as_str()) {
            return wrong(
                "kind",
                format!("`{}` is not a kind", file.kind),
                "write `point`, `pose`, `ball` or `distance`".into(),
            );
        }
        let join = match file.join {
            None => None,
            Some(by) if by == "rows" => Some(Join::Rows),
            Some(_) if !file.header => {
                return wrong("join", "a table without a header has no titles to join by".into(), "write `rows`".into());
            }
            Some(title) => Some(Join::Column(title)),
        };
        if join.is_some() && file.session_per_file {
            let problem = "joined files are one table, not one session each";
            return wrong("session_per_file", problem.into(), "leave it out".into());
        }
        let has_base = file.dataset.has_base();
        let mut dataset = Reading { path, text, within: "dataset." }.dataset(file.dataset, folder)?;
        let known = Column::all(&dataset.robot);
        let names: Vec<String> = known.iter().map(|c| c.quantity()).collect();
        let mut map = ColumnMap {
            delimiter,
            decimal: file.decimal,
            header: file.header,
            skip_lines: file.skip_lines,
            session_per_file: file.session_per_file,
            sheet: file.sheet,
            join,
            kind: file.kind,
            columns: Vec::new(),
            tool_targets: Vec::new(),
            rotation: None,
            flange: None,
            rows: file.rows,
            extra: Vec::new(),
            has_base,
        };
        for (name, source) in file.columns {
            let key = format!("columns.{name}");
            origin.check_places(&key, &source, map.header)?;
            if name.starts_with("extra_") {
                map.extra.push((name, source));
                continue;
            }
            let Some(k) = names.iter().position(|n| *n == name) else {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                return wrong(&key, "there is no such quantity".into(), name_remedy(&name, &names));
            };
            let column = known[k];
            let measure = origin.measure(&key, column, source.unit.as_deref())?;
            map.columns.push(MappedColumn { column, measure, source });
        }
        map.columns.sort_by_key(|m| known.iter().position(|c| *c == m.column));
        for (name, PointSource { x, y, z }) in file.targets {
            map.tool_targets.push(origin.tool_target(name, [x, y, z], &map)?);
        }
        origin.check_rows(&map)?;
        map.rotation = file.rotation.map(|source| origin.rotation(source, &map)).transpose()?;
        map.flange = file.flange.map(|source| origin.flange(source, &map, &dataset.robot)).transpose()?;
        map.declare_targets(&mut dataset);
        dataset.noise.seen_from_tool |= map.rotation.as_ref().is_some_and(|rotation| rotation.inverse);
        Ok((map, dataset))
    }

    /// Declares targets that the map reads and the dataset does not know: nothing is known of where they are.
    fn declare_targets(&self, dataset: &mut Dataset) {
        for (id, _) in &self.tool_targets {
            if !dataset.tool_targets.iter().any(|r| r.id == *id) {
                dataset.tool_targets.push(ToolTarget { id: id.clone(), position: Vector3::zeros(), sigma: 0.0, free: true });
            }
        }
    }

    /// A map for each point of the tool that a row measures, with its name; `None` for the TCP.
    pub fn by_point(&self) -> Vec<(Option<&str>, ColumnMap)> {
        let is_world = |c: Column| matches!(c, Column::World(_));
        let own = self.tool_targets.is_empty() || self.columns.iter().any(|m| is_world(m.column));
        let of = |world: &[MappedColumn; 3]| {
            let mut map = self.clone();
            let first = map.columns.iter().position(|m| is_world(m.column)).unwrap_or(map.columns.len());
            map.columns.retain(|m| !is_world(m.column) && m.column != Column::SigmaOrientation);
            map.rotation = None;
            map.columns.splice(first..first, world.iter().cloned());
            map
        };
        let tcp = own.then(|| (None, self.clone()));
        tcp.into_iter().chain(self.tool_targets.iter().map(|(name, world)| (Some(name.as_str()), of(world)))).collect()
    }

    /// The layout of the source.
    pub fn layout(&self) -> Layout<'_> {
        Layout { delimiter: self.delimiter, header: self.header, sheet: self.sheet.as_deref(), skip_lines: self.skip_lines }
    }

    /// True if a column of the source fills this column of the dataset.
    pub fn fills(&self, column: Column) -> bool {
        self.columns.iter().any(|m| m.column == column)
    }
}

/// The file of a map, for errors.
struct Origin<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Origin<'_> {
    fn wrong(&self, key: &str, problem: impl Into<String>, remedy: impl Into<String>) -> FileError {
        field_error(self.path, self.text, key, problem, remedy)
    }

    /// Checks that columns are named by title only in a table with a header, and by places from 1.
    fn check_places(&self, key: &str, source: &Source, header: bool) -> Result<(), FileError> {
        for (part, column) in [("column", Some(&source.column)), ("minus", source.minus.as_ref())] {
            let titled = matches!(column, Some(ColumnName::Title(_)));
            if titled && !header || column == Some(&ColumnName::Place(0)) {
                let problem = "columns of a table without a header have places, the first is 1";
                return Err(self.wrong(&format!("{key}.{part}"), problem, "give the place as a number"));
            }
        }
        Ok(())
    }

    /// The columns of a further measured point of the tool.
    fn tool_target(
        &self,
        name: String,
        sources: [Source; 3],
        map: &ColumnMap,
    ) -> Result<(String, [MappedColumn; 3]), FileError> {
        let key = format!("targets.{name}");
        if !matches!(map.kind.as_str(), "point" | "pose") || map.fills(Column::Target) {
            let problem = "further points of a row are of kind `point`, and are named here alone";
            return Err(self.wrong(&key, problem, "remove it, or the column `target` and the other kind"));
        }
        if name.trim().is_empty() || name.contains(char::is_control) {
            return Err(self.wrong(&key, "is not a name", "give a plain name"));
        }
        Ok((name, self.coordinates(&key, sources, map.header)?))
    }

    /// The columns of a position.
    fn coordinates(&self, table: &str, sources: [Source; 3], header: bool) -> Result<[MappedColumn; 3], FileError> {
        let mapped = |k: usize, source: Source| {
            let key = format!("{table}.{}", ["x", "y", "z"][k]);
            self.check_places(&key, &source, header)?;
            let measure = self.measure(&key, Column::World(k), source.unit.as_deref())?;
            Ok::<_, FileError>(MappedColumn { column: Column::World(k), measure, source })
        };
        let [x, y, z] = sources;
        Ok([mapped(0, x)?, mapped(1, y)?, mapped(2, z)?])
    }

    /// The pose from which joints are computed.
    fn flange(&self, source: FlangeSource, map: &ColumnMap, robot: &Robot) -> Result<MappedFlange, FileError> {
        if map.columns.iter().any(|m| matches!(m.column, Column::Joint(_) | Column::Slide(_))) {
            return Err(self.wrong("flange", "columns state the joints too", "keep one of them"));
        }
        if robot.joints() != SIX || robot.first_prismatic().is_some() {
            let problem = format!("a pose determines the joints of an arm of six that turn, and '{}' is another", robot.name);
            return Err(self.wrong("flange", problem, "give columns of the joints"));
        }
        let near: Vec<f64> = source.near_deg.iter().map(|v| v * DEG).collect();
        if near.len() != SIX || near.iter().any(|v| !v.is_finite()) {
            let problem = format!("{} numbers, and an arm has up to eight postures at one pose", near.len());
            return Err(self.wrong("flange.near_deg", problem, "give six joint angles in the middle of those of the rows"));
        }
        if source.rotation.inverse {
            return Err(self.wrong("flange.rotation.inverse", "a controller states the flange in the base", "remove it"));
        }
        let rotation = self.numbers_of("flange.rotation", source.rotation, map.header)?;
        let tool = source.tool.map_or(Pose::identity(), |tool| tool.frame().pose());
        let position = self.coordinates("flange", [source.x, source.y, source.z], map.header)?;
        Ok(MappedFlange { position, rotation, tool, near })
    }

    /// Checks that the order of the rows says nothing that a column says too.
    fn check_rows(&self, map: &ColumnMap) -> Result<(), FileError> {
        let Some(rows) = map.rows else { return Ok(()) };
        if rows.approach && map.columns.iter().any(|m| matches!(m.column, Column::Approach(_))) {
            return Err(self.wrong("rows.approach", "columns state the sides of approach too", "keep one of them"));
        }
        match rows.interval_s {
            Some(_) if map.fills(Column::Time) => {
                Err(self.wrong("rows.interval_s", "a column states the time too", "keep one of them"))
            }
            Some(interval) if !(interval > 0.0 && interval <= 1e6) => Err(self.wrong(
                "rows.interval_s",
                format!("{interval} s is not an interval"),
                "give the seconds from row to row",
            )),
            _ => Ok(()),
        }
    }

    /// The orientation in a row of kind `pose`.
    fn rotation(&self, source: RotationSource, map: &ColumnMap) -> Result<MappedRotation, FileError> {
        if map.kind != "pose" {
            let problem = format!("rows of kind `{}` have no orientation", map.kind);
            return Err(self.wrong("rotation", problem, "write `kind = \"pose\"`, or remove it"));
        }
        if source.inverse && !map.tool_targets.is_empty() {
            return Err(self.wrong("rotation.inverse", "further points would have to be inverted too", "remove them"));
        }
        if map.columns.iter().any(|m| matches!(m.column, Column::Rotation(_))) {
            return Err(self.wrong("rotation", "`rx`, `ry`, `rz` state the orientation too", "keep one of them"));
        }
        self.numbers_of("rotation", source, map.header)
    }

    /// The numbers of a rotation, by its form.
    fn numbers_of(&self, table: &str, source: RotationSource, header: bool) -> Result<MappedRotation, FileError> {
        let names: Vec<&str> = RotationForm::ALL.iter().map(|(_, name)| *name).collect();
        let Some((form, _)) = RotationForm::ALL.into_iter().find(|(_, name)| *name == source.form) else {
            let problem = format!("`{}` is not a form of a rotation", source.form);
            return Err(self.wrong(&format!("{table}.form"), problem, name_remedy(&source.form, &names)));
        };
        if source.columns.len() != form.count() {
            let problem = format!("{} columns, and the form has {} numbers", source.columns.len(), form.count());
            return Err(self.wrong(&format!("{table}.columns"), problem, "give one a number"));
        }
        let measured = |(k, source): (usize, Source)| {
            let key = format!("{table}.columns[{k}]");
            self.check_places(&key, &source, header)?;
            let measure = match (form.has_angles(), &source.unit) {
                (true, _) => {
                    self.measure(&key, Column::Rotation(k.min(2)), source.unit.as_deref())?.unwrap_or(Measure::Si(1.0))
                }
                (false, None) => Measure::Si(1.0),
                (false, Some(_)) => {
                    let what = if form == RotationForm::Matrix { "matrix" } else { "quaternion" };
                    return Err(self.wrong(&format!("{key}.unit"), format!("a {what} has no unit"), "remove it"));
                }
            };
            Ok((source, measure))
        };
        let numbers = source.columns.into_iter().enumerate().map(measured).collect::<Result<_, FileError>>()?;
        Ok(MappedRotation { form, inverse: source.inverse, numbers })
    }

    /// Meaning of the number in a column, by its unit as given; `None` for text.
    fn measure(&self, key: &str, column: Column, given: Option<&str>) -> Result<Option<Measure>, FileError> {
        let key = format!("{key}.unit");
        let name = column.quantity();
        match (column.unit(), given) {
            (None, None) => Ok(column.is_number().then_some(Measure::Si(1.0))),
            (None, Some(_)) => Err(self.wrong(&key, format!("`{name}` has no unit"), "remove it")),
            (Some(ours), given) => {
                let units = units_like(&ours);
                let Some((_, measure)) = units.iter().find(|(unit, _)| Some(*unit) == given) else {
                    let problem = given.map_or("the unit is missing".into(), |u| format!("`{u}` is not a unit of `{name}`"));
                    let list: Vec<&str> = units.iter().map(|(unit, _)| *unit).collect();
                    return Err(self.wrong(&key, problem, format!("give one of {}", list.join(", "))));
                };
                Ok(Some(*measure))
            }
        }
    }
}

/// The units accepted for a quantity that is written in `unit`.
fn units_like(unit: &str) -> &'static [(&'static str, Measure)] {
    match unit {
        "deg" => &[("deg", Measure::Si(DEG)), ("rad", Measure::Si(1.0))],
        "mm" | "um" => &[("mm", Measure::Si(MM)), ("m", Measure::Si(1.0)), ("um", Measure::Si(UM))],
        "s" => &[
            ("s", Measure::Si(1.0)),
            ("ms", Measure::Si(1e-3)),
            ("min", Measure::Si(60.0)),
            ("yyyymmddhhmmss", Measure::Timestamp),
        ],
        "c" => &[("c", Measure::Si(1.0))],
        "n" => &[("n", Measure::Si(1.0))],
        _ => &[("nm", Measure::Si(1.0))],
    }
}
