//! Cases: a scene's file, a camera, the clause that says what is drawn, and how far a picture may be from that.

use std::io::Cursor;
use std::path::Path;

use gaurast_oracle::oracle::{OracleCutOff, OracleOrder, OracleState};
use gaurast_scene::camera::{DEFAULT_NEAR, Model};
use gaurast_scene::{Camera, Distortion, Scene, SceneError, SortOrder};

use crate::gaussian::Gaussian;
use crate::gltf_file::Gltf;
use crate::ply_file::ply;
use crate::usd_file::Usd;

/// The force of a case's clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The text has a rule, which admits one picture to within the tolerance.
    Normative,
    /// The text recommends it, or the code of a program does it that has no text.
    Recommended,
    /// The text is silent, and this project does what 3DGS does.
    Choice,
}

impl Level {
    /// The name in manifests.
    pub fn name(self) -> &'static str {
        match self {
            Self::Normative => "normative",
            Self::Recommended => "recommended",
            Self::Choice => "choice",
        }
    }
}

/// A renderer that a picture is of: a value of `gaurast --as`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pipeline {
    /// diff-gaussian-rasterization.
    Inria,
    /// gsplat from 1.6 on.
    Gsplat,
    /// gsplat up to 1.5.
    Gsplat15,
    /// The rules of `KHR_gaussian_splatting`.
    Gltf,
    /// The rules of OpenUSD.
    Usd,
}

impl Pipeline {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Inria, Self::Gsplat, Self::Gsplat15, Self::Gltf, Self::Usd];

    /// The value of `--as`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inria => "inria",
            Self::Gsplat => "gsplat",
            Self::Gsplat15 => "gsplat-1.5",
            Self::Gltf => "gltf",
            Self::Usd => "usd",
        }
    }

    /// Its near plane; that of the cameras here where it has none.
    pub fn near(self) -> f64 {
        match self {
            Self::Inria | Self::Gltf | Self::Usd => 0.2,
            Self::Gsplat | Self::Gsplat15 => 0.01,
        }
    }

    /// Its rules, for a file with a hint on the order or without one.
    pub fn state(self, hint: Option<SortOrder>, is_compensated: bool) -> OracleState {
        let (cut_off, cut_off_deviations) = match self {
            Self::Inria => (OracleCutOff::TileSquare, 3.0),
            Self::Gsplat | Self::Gsplat15 => (OracleCutOff::TileRectangle, 3.33),
            Self::Gltf => (OracleCutOff::Ellipse, 3.0),
            Self::Usd => (OracleCutOff::None, 3.0),
        };
        let by_distance = self == Self::Gltf || self == Self::Usd && hint == Some(SortOrder::Distance);
        OracleState {
            alpha_ceiling: if self == Self::Gsplat15 { 0.999 } else { 0.99 },
            order: if by_distance { OracleOrder::RadialDistance } else { OracleOrder::ViewDepth },
            cut_off,
            cut_off_deviations,
            opacity_compensated: is_compensated,
            compensation_floor: if matches!(self, Self::Inria | Self::Gsplat) { 0.000_025 } else { 0.0 },
            ..OracleState::default()
        }
    }
}

/// A thing that a text leaves open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Freedom {
    /// The low-pass filter of 0.3 px^2 may be missing.
    LowPass,
    /// The cut-off at three standard deviations may be missing, or be there.
    CutOff,
    /// Alphas below 1/255 may count.
    Floor,
    /// Alphas may be above 0.99.
    Ceiling,
    /// Gaussians may be sorted by depth instead of distance, or the other way. Cases of other clauses do not depend on it.
    Order,
}

impl Freedom {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::LowPass, Self::CutOff, Self::Floor, Self::Ceiling, Self::Order];

    /// The other choice, for derivations.
    pub fn other(self) -> &'static str {
        match self {
            Self::LowPass => "no low-pass filter",
            Self::CutOff => "the other cut-off",
            Self::Floor => "no least alpha",
            Self::Ceiling => "no greatest alpha",
            Self::Order => "the other order",
        }
    }

    /// The rules with the other choice.
    #[must_use]
    pub fn taken(self, state: OracleState) -> OracleState {
        match self {
            Self::LowPass => OracleState { low_pass: 0.0, ..state },
            Self::CutOff => OracleState {
                cut_off: match state.cut_off {
                    OracleCutOff::None => OracleCutOff::Ellipse,
                    _ => OracleCutOff::None,
                },
                ..state
            },
            Self::Floor => OracleState { alpha_floor: 0.0, ..state },
            // The transmittance floor of 0.0001 is reached by nothing else.
            Self::Ceiling => OracleState { alpha_ceiling: 0.9998, ..state },
            Self::Order => OracleState {
                order: match state.order {
                    OracleOrder::ViewDepth => OracleOrder::RadialDistance,
                    _ => OracleOrder::ViewDepth,
                },
                ..state
            },
        }
    }
}

/// The content of a scene's file.
#[derive(Clone, Debug)]
pub enum Source {
    /// glTF.
    Gltf(Gltf),
    /// USD as text.
    Usd(Usd),
    /// PLY of 3DGS.
    Ply(Vec<Gaussian>),
}

impl Source {
    /// The file, with `camera` where the format has cameras.
    pub fn bytes(&self, camera: &Camera) -> Vec<u8> {
        match self {
            Self::Gltf(gltf) => gltf.bytes(camera),
            Self::Usd(usd) => usd.bytes(),
            Self::Ply(gaussians) => ply(gaussians),
        }
    }

    /// The scene as it is read from the file.
    ///
    /// # Errors
    /// If the file is not read.
    pub fn scene(&self, camera: &Camera) -> Result<Scene, SceneError> {
        let bytes = self.bytes(camera);
        let name = format!("scene.{}", self.extension());
        gaurast_scene::read(Path::new(&name), &mut Cursor::new(&bytes), bytes.len() as u64)
    }

    /// The file name's extension.
    pub fn extension(&self) -> &'static str {
        match self {
            Self::Gltf(_) => "gltf",
            Self::Usd(_) => "usda",
            Self::Ply(_) => "ply",
        }
    }

    /// The directions of 3DGS's axes (right, down, forward) in the file's.
    pub fn axes(&self) -> [[f64; 3]; 3] {
        match self {
            Self::Ply(_) => [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            Self::Usd(usd) if usd.up == 'Z' => [[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]],
            Self::Gltf(_) | Self::Usd(_) => [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, -1.0]],
        }
    }
}

/// A misreading, whose picture is apart from the right one.
#[derive(Clone, Debug)]
pub struct Mistake {
    /// The property that is read wrong.
    pub what: &'static str,
    /// The file that, read right, gives the picture.
    pub source: Option<Source>,
    /// The change of the rules that gives it.
    pub change: Option<fn(OracleState) -> OracleState>,
}

/// A scene with its picture.
#[derive(Clone, Debug)]
pub struct Case {
    /// The name, which files have, too.
    pub name: String,
    /// The name of the scene's file without its extension; cases may share one.
    pub scene: String,
    /// The renderer that the picture is of.
    pub pipeline: Pipeline,
    /// The force of its clause.
    pub level: Level,
    /// The place in the text.
    pub clause: &'static str,
    /// The property that the picture shows.
    pub shows: &'static str,
    /// The scene.
    pub source: Source,
    /// The camera, in the axes of 3DGS.
    pub camera: Camera,
    /// True if the opacity makes up for the low-pass filter.
    pub is_compensated: bool,
    /// The choices that both the text and the case leave open.
    pub freedoms: Vec<Freedom>,
    /// A misreading.
    pub mistake: Option<Mistake>,
}

impl Case {
    /// A case of one of the two formats' texts, seen from the front.
    pub fn of_format(name: &str, level: Level, clause: &'static str, shows: &'static str, source: Source) -> Self {
        let (pipeline, format) = match &source {
            Source::Usd(_) => (Pipeline::Usd, "usd"),
            Source::Gltf(_) | Source::Ply(_) => (Pipeline::Gltf, "gltf"),
        };
        let name = format!("{format}-{name}");
        Self {
            scene: name.clone(),
            name,
            pipeline,
            level,
            clause,
            shows,
            source,
            camera: front(),
            is_compensated: false,
            freedoms: Freedom::ALL.to_vec(),
            mistake: None,
        }
    }

    /// The same seen by another camera.
    #[must_use]
    pub fn seen_by(self, camera: Camera) -> Self {
        Self { camera, ..self }
    }

    /// The same, with nothing left open of this.
    #[must_use]
    pub fn deciding(mut self, decided: &[Freedom]) -> Self {
        self.freedoms.retain(|freedom| !decided.contains(freedom));
        self
    }

    /// The same with a misreading that another file shows.
    #[must_use]
    pub fn unlike(self, what: &'static str, source: Source) -> Self {
        Self { mistake: Some(Mistake { what, source: Some(source), change: None }), ..self }
    }

    /// The same with a misreading that other rules show.
    #[must_use]
    pub fn unlike_rules(self, what: &'static str, change: fn(OracleState) -> OracleState) -> Self {
        Self { mistake: Some(Mistake { what, source: None, change: Some(change) }), ..self }
    }
}

/// The pictures' size in pixels.
const SIZE: [u32; 2] = [40, 30];

/// A pinhole camera with a focal length of 40 pixels.
fn camera(rotation: [[f64; 3]; 3], eye: [f64; 3]) -> Camera {
    let [width, height] = SIZE;
    Camera {
        model: Model::Pinhole,
        // Files and devices hold the rotation in binary32; 0 has no sign.
        rotation: rotation.map(|row| row.map(|part| f64::from(part as f32) + 0.0)),
        eye,
        focal: [40.0; 2],
        principal: [f64::from(width) / 2.0, f64::from(height) / 2.0],
        distortion: Distortion::default(),
        width,
        height,
        near: DEFAULT_NEAR,
        far: f64::INFINITY,
    }
}

/// The camera 4 units before the origin.
pub fn front() -> Camera {
    camera([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [0.0, 0.0, -4.0])
}

/// A camera to the right and above, which is rolled.
pub fn aslant() -> Camera {
    let eye = [2.0, -1.5, -3.0];
    let looking = Camera::look_at(eye, [0.0; 3], [0.25, -1.0, 0.0], 50.0, SIZE);
    camera(looking.expect("the directions differ").rotation, eye)
}
