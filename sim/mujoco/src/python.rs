//! The embedded Python, and the environment from which it loads MuJoCo.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList};

/// Interpreter of the environment that the program was built with.
const BUILT_WITH: &str = env!("CALIBENCH_PYTHON");

/// The only file that names the packages and their versions.
const REQUIREMENTS: &str = include_str!("../requirements.in");

/// Reasons why MuJoCo is not available in this process.
#[derive(Debug, thiserror::Error)]
pub enum PythonError {
    /// The environment is missing, or is not a virtual environment.
    #[error("{}: {source}; run sim/setup.sh, which makes the Python environment, or name another by CALIBENCH_VENV", path.display())]
    NoEnvironment {
        /// The file that could not be read.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// The program is linked with a different Python from the one that made the environment.
    #[error(
        "this program contains Python {running}, and {} was made with Python {made}: `cargo clean -p pyo3-ffi` (with --release if you build so), \
         then build again with PYO3_PYTHON={}/bin/python",
        venv.display(), venv.display()
    )]
    OtherPython {
        /// The environment.
        venv: PathBuf,
        /// Version of the Python in this process.
        running: String,
        /// Version of the Python that the environment was made with.
        made: String,
    },
    /// The right Python loaded the modules of another installation, found by `python3` in `PATH`.
    #[error(
        "another python3 comes first in PATH, so that Python takes its modules from {} in place of {}: `source {}/bin/activate` first",
        found.display(), expected.display(), venv.display()
    )]
    OtherModules {
        /// The environment.
        venv: PathBuf,
        /// Installation of the modules in use.
        found: PathBuf,
        /// Installation that the environment was made with.
        expected: PathBuf,
    },
    /// MuJoCo is installed in another version.
    #[error("{} holds mujoco {found}, and {wanted} is needed: run sim/setup.sh", venv.display())]
    OtherMujoco {
        /// The environment.
        venv: PathBuf,
        /// Its version of MuJoCo.
        found: String,
        /// The pinned version.
        wanted: String,
    },
    /// Python raised an exception, most likely because a package is missing or broken.
    #[error("MuJoCo cannot be loaded from {}: {source}; run sim/setup.sh, which repairs it", venv.display())]
    Raised {
        /// The environment.
        venv: PathBuf,
        /// The exception.
        source: PyErr,
    },
}

/// Returns Python's module `mujoco`, in the pinned version, from the environment named by `CALIBENCH_VENV`, or else from the
/// one that the program was built with.
///
/// The first call takes a third of a second. It lets MuJoCo render without a display, unless `MUJOCO_GL` selects a backend.
///
/// # Errors
/// [`PythonError`], which names the remedy.
pub fn mujoco(py: Python<'_>) -> Result<Bound<'_, PyModule>, PythonError> {
    static MUJOCO: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    let module = MUJOCO.get_or_try_init(py, || {
        let environment = Environment::find()?;
        environment.check_interpreter(py)?;
        let module = environment.import(py)?;
        // Its warnings would go to a file in the current directory; the conditions that they report are detected from
        // the numbers.
        let silent = py.eval(c"lambda text: None", None, None);
        silent.and_then(|f| module.call_method1("set_mju_user_warning", (f,))).map_err(|e| environment.raised(e))?;
        Ok::<_, PythonError>(module.unbind())
    })?;
    Ok(module.bind(py).clone())
}

/// A Python environment as `python -m venv` makes it.
struct Environment {
    venv: PathBuf,
    /// Version of the Python that made it, such as 3.11.7.
    version: String,
    /// Installation directory of that Python.
    base: PathBuf,
}

impl Environment {
    fn find() -> Result<Self, PythonError> {
        let named = std::env::var_os("CALIBENCH_VENV").filter(|name| !name.is_empty());
        let built_with = || Path::new(BUILT_WITH).ancestors().nth(2).unwrap_or(Path::new("")).to_owned();
        Self::read(named.map_or_else(built_with, PathBuf::from))
    }

    fn read(venv: PathBuf) -> Result<Self, PythonError> {
        let path = venv.join("pyvenv.cfg");
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(source) => return Err(PythonError::NoEnvironment { path, source }),
        };
        let keys: BTreeMap<&str, &str> =
            text.lines().filter_map(|line| line.split_once('=')).map(|(key, value)| (key.trim(), value.trim())).collect();
        let (Some(version), Some(executable)) = (keys.get("version"), keys.get("executable")) else {
            let source = std::io::Error::new(std::io::ErrorKind::InvalidData, "it does not report `version` and `executable`");
            return Err(PythonError::NoEnvironment { path, source });
        };
        let base = Path::new(executable).ancestors().nth(2).unwrap_or(Path::new("")).to_owned();
        Ok(Self { version: (*version).to_owned(), base, venv })
    }

    /// Checks that the Python in this process is the one that made the environment: its packages contain code compiled
    /// for that one only.
    fn check_interpreter(&self, py: Python<'_>) -> Result<(), PythonError> {
        let running = Python::version_str().split_whitespace().next().unwrap_or_default();
        if running != self.version {
            return Err(PythonError::OtherPython {
                venv: self.venv.clone(),
                running: running.to_owned(),
                made: self.version.clone(),
            });
        }
        let prefix = || py.import("sys")?.getattr("base_prefix")?.extract();
        let found: PathBuf = prefix().map_err(|source| self.raised(source))?;
        let resolved = |path: &Path| path.canonicalize().unwrap_or_else(|_| path.to_owned());
        if resolved(&found) != resolved(&self.base) {
            return Err(PythonError::OtherModules { venv: self.venv.clone(), found, expected: self.base.clone() });
        }
        Ok(())
    }

    fn import<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyModule>, PythonError> {
        let load = || -> PyResult<(Bound<'py, PyModule>, String)> {
            let paths = PyDict::new(py);
            paths.set_item("base", &self.venv)?;
            paths.set_item("platbase", &self.venv)?;
            let packages = py.import("sysconfig")?.call_method1("get_path", ("purelib", "venv", paths))?;
            py.import("site")?.call_method1("addsitedir", (&packages,))?;
            // First in the path, or the user's own packages would come before the pinned ones.
            let sys_path = py.import("sys")?.getattr("path")?.cast_into::<PyList>()?;
            while sys_path.contains(&packages)? {
                sys_path.call_method1("remove", (&packages,))?;
            }
            sys_path.insert(0, packages)?;
            // Without this MuJoCo looks for a window system when it is to render.
            let environ = py.import("os")?.getattr("environ")?;
            environ.call_method1("setdefault", ("MUJOCO_GL", "egl"))?;
            let module = py.import("mujoco")?;
            let version = module.getattr("__version__")?.extract()?;
            Ok((module, version))
        };
        let (module, found) = load().map_err(|source| self.raised(source))?;
        let wanted = pinned_mujoco();
        if found == wanted {
            Ok(module)
        } else {
            Err(PythonError::OtherMujoco { venv: self.venv.clone(), found, wanted: wanted.to_owned() })
        }
    }

    fn raised(&self, source: PyErr) -> PythonError {
        PythonError::Raised { venv: self.venv.clone(), source }
    }
}

fn pinned_mujoco() -> &'static str {
    REQUIREMENTS.lines().find_map(|line| line.strip_prefix("mujoco==")).expect("requirements.in pins mujoco")
}
