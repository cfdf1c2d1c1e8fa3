//! MuJoCo as used by this plant: a model, its data, and views of the arrays that are read and written at every step.

use calibench::robot::Pose;
use nalgebra::{Matrix3, Rotation3, Translation3, Vector3};
use numpy::{PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::IntoPyDict;

use super::python;
use calibench_sim::mechanics::PlantError;

/// Arrays of numbers shared by MuJoCo and this program, in MuJoCo's order.
type Numbers = Py<PyArrayDyn<f64>>;

/// A loaded model. All its joints have one degree of freedom, so an index into `qpos` is also an index into `qvel`.
pub struct Engine {
    step: Py<PyAny>,
    forward: Py<PyAny>,
    kinematics: Py<PyAny>,
    set_const: Py<PyAny>,
    model: Py<PyAny>,
    data: Py<PyAny>,
    qpos: Numbers,
    qvel: Numbers,
    ctrl: Numbers,
    warm_start: Numbers,
    gravity_and_motion: Numbers,
    site_at: Numbers,
    site_turned: Numbers,
    body_at: Numbers,
    body_turned: Numbers,
    mocap_at: Numbers,
}

/// Fields of a loaded model that can be changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)] // MuJoCo's own names
pub enum Field {
    QposSpring,
    DofFrictionloss,
    TendonLengthspring,
    GeomPos,
    GeomSize,
    GeomRbound,
    BodyMass,
    BodyIpos,
}

impl Field {
    fn name(self) -> &'static str {
        match self {
            Field::QposSpring => "qpos_spring",
            Field::DofFrictionloss => "dof_frictionloss",
            Field::TendonLengthspring => "tendon_lengthspring",
            Field::GeomPos => "geom_pos",
            Field::GeomSize => "geom_size",
            Field::GeomRbound => "geom_rbound",
            Field::BodyMass => "body_mass",
            Field::BodyIpos => "body_ipos",
        }
    }
}

/// Kinds of named objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum Thing {
    Body,
    Joint,
    Geom,
    Tendon,
}

impl Thing {
    /// Its name in MuJoCo's accessor functions.
    fn accessor(self) -> &'static str {
        match self {
            Thing::Body => "body",
            Thing::Joint => "joint",
            Thing::Geom => "geom",
            Thing::Tendon => "tendon",
        }
    }
}

impl Engine {
    /// Starts Python and MuJoCo if they are not running yet, and loads a document.
    ///
    /// # Errors
    /// [`PlantError::Absent`] if they are not available; [`PlantError::Restless`] when MuJoCo refuses the document.
    pub fn load(mjcf: &str) -> Result<Self, PlantError> {
        Python::attach(|py| {
            let mujoco = python::mujoco(py).map_err(|e| PlantError::Absent { plant: "mujoco", reason: e.to_string() })?;
            let load = || -> PyResult<Engine> {
                let model = mujoco.getattr("MjModel")?.call_method1("from_xml_string", (mjcf,))?;
                let data = mujoco.getattr("MjData")?.call1((&model,))?;
                let function = |name: &str| mujoco.getattr(name).map(Bound::unbind);
                let numbers =
                    |name: &str| -> PyResult<Numbers> { Ok(data.getattr(name)?.cast_into::<PyArrayDyn<f64>>()?.unbind()) };
                Ok(Engine {
                    step: function("mj_step")?,
                    forward: function("mj_forward")?,
                    kinematics: function("mj_kinematics")?,
                    set_const: function("mj_setConst")?,
                    qpos: numbers("qpos")?,
                    qvel: numbers("qvel")?,
                    ctrl: numbers("ctrl")?,
                    warm_start: numbers("qacc_warmstart")?,
                    gravity_and_motion: numbers("qfrc_bias")?,
                    site_at: numbers("site_xpos")?,
                    site_turned: numbers("site_xmat")?,
                    body_at: numbers("xpos")?,
                    body_turned: numbers("xmat")?,
                    mocap_at: numbers("mocap_pos")?,
                    model: model.unbind(),
                    data: data.unbind(),
                })
            };
            load().map_err(|e| PlantError::Restless { detail: format!("MuJoCo refuses the model: {e}") })
        })
    }

    /// Index of a named object: for a joint its index in `qpos`, for anything else its number.
    ///
    /// # Errors
    /// When there is no object of that name.
    pub fn place(&self, thing: Thing, name: &str) -> Result<usize, PlantError> {
        let get = |py: Python<'_>| -> PyResult<usize> {
            let found = self.model.bind(py).call_method1(thing.accessor(), (name,))?;
            match thing {
                Thing::Joint => found.getattr("qposadr")?.get_item(0)?.extract(),
                _ => found.getattr("id")?.extract(),
            }
        };
        Python::attach(|py| get(py).map_err(failed))
    }

    /// Advances the simulation by `times` steps.
    ///
    /// # Errors
    /// When MuJoCo raises an exception.
    pub fn step(&self, times: usize) -> Result<(), PlantError> {
        Python::attach(|py| self.step.bind(py).call1((&self.model, &self.data, times)).map(drop).map_err(failed))
    }

    /// Evaluates all quantities at the present state without advancing it.
    ///
    /// # Errors
    /// When MuJoCo raises an exception.
    pub fn forward(&self) -> Result<(), PlantError> {
        self.call(&self.forward)
    }

    /// Evaluates the poses of the bodies.
    ///
    /// # Errors
    /// When MuJoCo raises an exception.
    pub fn kinematics(&self) -> Result<(), PlantError> {
        self.call(&self.kinematics)
    }

    fn call(&self, function: &Py<PyAny>) -> Result<(), PlantError> {
        Python::attach(|py| function.bind(py).call1((&self.model, &self.data)).map(drop).map_err(failed))
    }

    /// Recomputes the quantities that MuJoCo derives from masses, after masses were changed. The state is restored afterwards.
    ///
    /// # Errors
    /// When MuJoCo raises an exception.
    pub fn masses_changed(&self) -> Result<(), PlantError> {
        let qpos = self.qpos(|q| q.to_vec());
        self.call(&self.set_const)?;
        self.qpos(|q| q.copy_from_slice(&qpos));
        Ok(())
    }

    /// Joint positions, rad or m.
    pub fn qpos<T>(&self, use_them: impl FnOnce(&mut [f64]) -> T) -> T {
        with(&self.qpos, use_them)
    }

    /// Joint speeds, rad/s or m/s.
    pub fn qvel<T>(&self, use_them: impl FnOnce(&mut [f64]) -> T) -> T {
        with(&self.qvel, use_them)
    }

    /// Commands of the actuators.
    pub fn ctrl<T>(&self, use_them: impl FnOnce(&mut [f64]) -> T) -> T {
        with(&self.ctrl, use_them)
    }

    /// Moves the first mocap body to this position, world, m.
    pub fn move_mocap(&self, to: &Vector3<f64>) {
        with(&self.mocap_at, |at| at[..3].copy_from_slice(to.as_slice()));
    }

    /// Generalised force that holds the arm in its pose, at the last evaluation (`qfrc_bias`), N·m or N.
    pub fn holding(&self) -> Vec<f64> {
        with(&self.gravity_and_motion, |f| f.to_vec())
    }

    /// Sets all velocities to zero and clears the solver's warm start.
    pub fn halt(&self) {
        self.qvel(|v| v.fill(0.0));
        with(&self.warm_start, |a| a.fill(0.0));
    }

    /// `world_from_site` of the first site at the last evaluation.
    pub fn site(&self) -> Pose {
        pose(&self.site_at, &self.site_turned, 0)
    }

    /// `world_from_body` of a body at the last evaluation.
    pub fn body(&self, place: usize) -> Pose {
        pose(&self.body_at, &self.body_turned, place)
    }

    /// Renders a picture, as rows of red, green and blue bytes.
    ///
    /// # Errors
    /// MuJoCo's message, if this machine cannot render off-screen.
    pub fn picture(&self, camera: &str, width: usize, height: usize) -> Result<Vec<u8>, PlantError> {
        let draw = |py: Python<'_>| -> PyResult<Vec<u8>> {
            let renderer = python::mujoco(py)
                .map_err(|e| PyRuntimeError::new_err(e.to_string()))?
                .getattr("Renderer")?
                .call1((&self.model, height, width))?;
            let camera = [("camera", camera)].into_py_dict(py)?;
            renderer.call_method("update_scene", (&self.data,), Some(&camera))?;
            let picture = renderer.call_method0("render")?.call_method0("tobytes")?.extract()?;
            renderer.call_method0("close")?;
            Ok(picture)
        };
        Python::attach(|py| draw(py).map_err(failed))
    }

    /// Changes a field of the model.
    ///
    /// # Errors
    /// When the model has no such field.
    pub fn change<T>(&self, field: Field, use_them: impl FnOnce(&mut [f64]) -> T) -> Result<T, PlantError> {
        let get = |py: Python<'_>| -> PyResult<Numbers> {
            Ok(self.model.bind(py).getattr(field.name())?.cast_into::<PyArrayDyn<f64>>()?.unbind())
        };
        let numbers = Python::attach(get).map_err(failed)?;
        Ok(with(&numbers, use_them))
    }
}

/// Lends an array of MuJoCo's. Each is one contiguous block, and nobody else holds it while it is lent: the engine is
/// not shared.
fn with<T>(numbers: &Numbers, use_them: impl FnOnce(&mut [f64]) -> T) -> T {
    Python::attach(|py| {
        let mut lent = numbers.bind(py).readwrite();
        match lent.as_slice_mut() {
            Ok(slice) => use_them(slice),
            Err(_) => unreachable!("MuJoCo's arrays are contiguous"),
        }
    })
}

/// The pose of the object with this index.
fn pose(at: &Numbers, turned: &Numbers, place: usize) -> Pose {
    let at = with(at, |at| Vector3::from_row_slice(&at[3 * place..][..3]));
    let turned = with(turned, |m| Matrix3::from_row_slice(&m[9 * place..][..9]));
    Pose::from_parts(Translation3::from(at), Rotation3::from_matrix_unchecked(turned))
}

fn failed(error: PyErr) -> PlantError {
    PlantError::Restless { detail: error.to_string() }
}
