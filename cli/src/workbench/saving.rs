//! Output files of the workbench: fixed names in one folder.

use std::path::{Path, PathBuf};

use calibench::assess::Proposal;
use calibench::files::{FileError, write_whole};
use calibench::identify::{Model, write_model, write_model_like};
use calibench_report::page_html;
use serde_json::{Value, json};

use crate::proposal_files::write_proposal;

/// The folder that a workbench may write into, and the model file whose layout it keeps.
pub struct Place {
    folder: PathBuf,
    like: Option<PathBuf>,
}

/// Description of the files written.
pub struct Saved(String);

impl Saved {
    /// The same as JSON, for the page.
    pub fn json(&self) -> Value {
        json!({"saved": self.0})
    }
}

impl Place {
    /// A place in `folder`, which is created on the first write; models are written in the layout of the file `like`.
    pub fn new(folder: PathBuf, like: Option<PathBuf>) -> Self {
        Place { folder, like }
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
        Ok(Saved(path.display().to_string()))
    }

    /// Writes the page atomically.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_report(&self, document: &Value) -> Result<Saved, FileError> {
        let path = self.folder.join("report.html");
        write_whole(&path, page_html(document).as_bytes())?;
        Ok(Saved(path.display().to_string()))
    }

    /// Writes the proposed poses; `None` if nothing in the proposal can be planned.
    ///
    /// # Errors
    /// When the folder cannot be written.
    pub fn save_plan(&self, proposal: &Proposal, robot: &str) -> Result<Option<Saved>, FileError> {
        let written = write_proposal(&self.folder.join("plan.toml"), proposal, robot, None)?;
        Ok((!written.is_empty()).then(|| Saved(written.join(", "))))
    }
}
