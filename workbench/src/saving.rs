//! Output files of the workbench: fixed names in one folder.

use std::path::{Path, PathBuf};

use calibench::compensate::rigid::RigidRobot;
use calibench::compensate::urdf::urdf;
use calibench::files::FileError;
use calibench::files::disk::write_whole;
use calibench::identify::Model;
use calibench::identify::calibration::{Calibration, write_calibration};
use calibench::identify::model_file::{write_model, write_model_like};
use calibench::planning::Proposal;
use calibench::robot::Robot;
use calibench::robot::robot_file::RobotReference;
use calibench::robot::urdf::calibrated_urdf;
use calibench::units::MM;
use serde_json::{Value, json};

use crate::proposal_files::write_proposal;
use calibench_report::page_html;

/// The folder that a workbench may write into, and the model file whose layout it keeps.
pub struct Place {
    folder: PathBuf,
    like: Option<PathBuf>,
    urdf: Option<String>,
}

/// Description of the files written.
pub struct Saved {
    words: String,
    files: Vec<PathBuf>,
}

impl Saved {
    /// One file.
    fn one(path: PathBuf) -> Self {
        Saved { words: path.display().to_string(), files: vec![path] }
    }

    /// The same with something to be known beside it.
    pub(super) fn and(self, remark: &str) -> Self {
        Saved { words: self.words + remark, ..self }
    }

    /// The same as JSON, for the page.
    pub fn json(&self) -> Value {
        json!({"saved": self.words, "files": self.files})
    }
}

impl Place {
    /// A place in `folder`, which is created on the first write; models are written in the layout of the file `like`.
    pub fn new(folder: PathBuf, like: Option<PathBuf>) -> Self {
        Place { folder, like, urdf: None }
    }

    /// The same place; URDF files are written as this one with other joint origins: a path, as [`RobotReference`] has it.
    #[must_use]
    pub fn with_urdf(self, urdf: Option<String>) -> Self {
        Place { urdf, ..self }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The model's file.
    pub fn model(&self) -> PathBuf {
        self.folder.join("model.toml")
    }

    /// Writes the model atomically.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_model(&self, model: &Model) -> Result<Saved, FileError> {
        let path = self.model();
        match &self.like {
            Some(like) => write_model_like(model, like, &path)?,
            None => write_model(model, &path)?,
        }
        Ok(Saved::one(path))
    }

    /// Writes the calibration atomically.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_calibration(&self, calibration: &Calibration) -> Result<Saved, FileError> {
        let path = self.folder.join("calibration.toml");
        write_calibration(calibration, &path)?;
        Ok(Saved::one(path))
    }

    /// Writes the identified links atomically.
    ///
    /// # Errors
    /// When the folder cannot be written, or the robot's own file is no longer there.
    pub fn save_urdf(&self, nominal: &Robot, rigid: &RigidRobot) -> Result<Saved, FileError> {
        let path = self.folder.join("calibrated.urdf");
        let text = match &self.urdf {
            None => urdf(rigid),
            Some(of) => {
                let RobotReference { name, ends } = RobotReference::parse(of);
                calibrated_urdf(Path::new(name), &ends, nominal, &rigid.robot)?
            }
        };
        write_whole(&path, text.as_bytes())?;
        let left_out = match rigid.effects.as_slice() {
            [] => String::new(),
            effects => {
                let [mean, max] = [rigid.left_out.mean, rigid.left_out.max].map(|e| e / MM);
                format!(
                    "; what it cannot hold ({}) moves the TCP by {mean:.3} mm in the mean, {max:.3} mm at most",
                    effects.join(", ")
                )
            }
        };
        Ok(Saved::one(path).and(&left_out))
    }

    /// Writes the page atomically.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_report(&self, document: &Value) -> Result<Saved, FileError> {
        let path = self.folder.join("report.html");
        write_whole(&path, page_html(document).as_bytes())?;
        Ok(Saved::one(path))
    }

    /// Writes the proposed poses; `None` if nothing in the proposal can be planned.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_plan(&self, proposal: &Proposal, robot: &str) -> Result<Option<Saved>, FileError> {
        let path = self.folder.join("plan.toml");
        let written = write_proposal(&path, proposal, robot, None)?;
        Ok((!written.files.is_empty()).then(|| Saved { words: written.words.join(", "), files: written.files }))
    }
}
