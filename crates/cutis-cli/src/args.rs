//! The command line.

mod sweep;

use std::path::PathBuf;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args as Group, Parser, Subcommand};
use cutis::mesh::{SkinMode, Split};
use cutis::render::Side;
use cutis::scene::{Override, constraint_kinds};
use cutis::volume::{ReadOptions, sample::LatticeSize};
use cutis::{FieldDirection, ResampleInput};

pub(crate) use sweep::SweepArgs;

/// Cut a CT scan and watch skin tension open the wound.
///
/// Exit codes: 0 done, 1 failed while running, 2 bad input or usage.
#[derive(Debug, Parser)]
#[command(
    name = "cutis",
    version,
    max_term_width = 100,
    after_help = "`cutis --xml` describes the program as a command-line module of 3D Slicer, which runs it."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run the whole pipeline on the built-in phantom
    ///
    /// The wound is shown where it ends up, to an error of 1 %. With `--frames` its motion is
    /// computed.
    Demo {
        /// Run folder
        #[arg(long, default_value = "cutis-demo")]
        out: PathBuf,
        #[command(flatten)]
        change: Change,
        /// Print report.json on standard output
        #[arg(long)]
        json: bool,
    },
    /// Run a scene
    Run(RunArgs),
    /// Find where a wound ends up: straight to the state of rest, without the motion
    ///
    /// Frames are computed first only if something happens over time in the scene: cuts that grow,
    /// sutures, handles.
    Settle(RunArgs),
    /// Show what a scene would cost: sizes, memory, time, and what it skips
    Check {
        /// Scene file (TOML)
        scene: PathBuf,
        #[command(flatten)]
        change: Change,
        /// Replace the scene's lattice: native, a spacing in mm, or nx,ny,nz
        #[arg(long)]
        lattice: Option<LatticeSize>,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Find solver settings for a scene on this machine, and write a copy of the scene with them
    ///
    /// It also searches for the state of rest once, prints how long that takes, and says where
    /// frames are not needed because only the state of rest counts.
    Tune {
        /// Scene file (TOML)
        scene: PathBuf,
        #[command(flatten)]
        tune: TuneArgs,
        #[command(flatten)]
        change: Change,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Run many scans with many settings, and collect the results in one table
    ///
    /// A sweep that was interrupted goes on where it ended, and a changed study repeats only what
    /// changed. Exit code 1 says that some cases are not done.
    Sweep {
        /// Study file (TOML)
        study: PathBuf,
        #[command(flatten)]
        args: SweepArgs,
    },
    /// Describe a volume file, or list the series in a folder of DICOM files
    Inspect {
        #[command(flatten)]
        volume: VolumeArgs,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Write a volume in another format
    Convert {
        #[command(flatten)]
        volume: VolumeArgs,
        /// File to write (.nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd)
        #[arg(long)]
        out: PathBuf,
    },
    /// Detect the skin of a volume
    Skin {
        #[command(flatten)]
        volume: VolumeArgs,
        /// Lattice: native, a spacing in mm, or nx,ny,nz
        #[arg(long, default_value = "native")]
        lattice: LatticeSize,
        /// Detection rule
        #[arg(long, value_parser = one_of(&MODES), default_value = "exterior")]
        mode: SkinMode,
        /// How a lattice cell is split
        #[arg(long, value_parser = one_of(&SPLITS), default_value = "kuhn6")]
        split: Split,
        /// HU to add to every value of the file, as volume.offset_hu of a scene
        #[arg(long, value_name = "HU", default_value_t = 0.0, allow_negative_numbers = true)]
        offset_hu: f32,
        /// Write the triangles (.vtu, .vtp, .ply or .stl)
        #[arg(long)]
        out: Option<PathBuf>,
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Make a synthetic CT of a torso
    Phantom {
        /// Voxels per axis: nx,ny,nz
        #[arg(long, visible_alias = "lattice", value_parser = size, default_value = "128,128,96")]
        size: [usize; 3],
        /// Seed of the anatomy and the noise
        #[arg(long, default_value_t = 0)]
        seed: u64,
        /// Turn the person in the scanner: degrees about the x axis first, then about y, then z
        #[arg(long, num_args = 3, value_names = ["X", "Y", "Z"], value_parser = angle,
              allow_negative_numbers = true)]
        turn_deg: Vec<f64>,
        /// File to write (.nii or .nii.gz)
        #[arg(long)]
        out: PathBuf,
    },
    /// Deform another volume or a label map as a finished run deformed its CT
    Resample {
        /// Scene file of the run
        scene: PathBuf,
        /// Run folder; it must hold a checkpoint
        #[arg(long)]
        run: PathBuf,
        #[command(flatten)]
        input: ResampleArgs,
        /// File to write (.nii, .nii.gz, .nrrd, .nhdr, .mha or .mhd)
        #[arg(long)]
        out: PathBuf,
        #[command(flatten)]
        change: Change,
    },
    /// Draw a volume: its skin from one side, or a slice
    Render {
        #[command(flatten)]
        volume: VolumeArgs,
        /// File to write (.png)
        #[arg(long)]
        out: PathBuf,
        /// Side to look from
        #[arg(long, value_parser = one_of(&SIDES), default_value = "anterior", conflicts_with = "slice")]
        side: Side,
        /// Draw a slice: axial@MM, coronal@MM or sagittal@MM
        #[arg(long)]
        slice: Option<String>,
        /// Window of a slice: level/width in HU
        #[arg(long, default_value = "40/400", requires = "slice")]
        window: String,
        /// Center of a close-up: x,y,z in mm
        #[arg(long, requires = "zoom")]
        focus: Option<String>,
        /// Size of a close-up, mm
        #[arg(long, requires = "focus")]
        zoom: Option<f64>,
        /// Width and height, pixels
        #[arg(long, default_value_t = 800)]
        pixels: usize,
    },
    /// List the GPUs of this machine, and the one that `--backend auto` selects
    Devices {
        /// Print as JSON
        #[arg(long)]
        json: bool,
    },
    /// Print completions for a shell
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Write man pages: one for the program, and one for each command
    Man {
        /// Folder of the pages
        #[arg(required_unless_present = "markdown")]
        folder: Option<PathBuf>,
        /// Print the help of all commands as one page of Markdown
        #[arg(long, conflicts_with = "folder")]
        markdown: bool,
    },
    /// Print a new scene, or the schemas of scenes, studies and reports
    Scene {
        #[command(subcommand)]
        what: SceneCommand,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum SceneCommand {
    /// A commented scene
    ///
    /// With a volume the scene names it, cuts the skin in the middle of its front, and fixes what
    /// lies behind. Change the cut to your own.
    New {
        /// Volume file, or a folder with a DICOM series
        volume: Option<PathBuf>,
        /// Number of the DICOM series, if the folder has several
        #[arg(long, value_name = "NUMBER", requires = "volume")]
        series: Option<u32>,
        /// Resample tilted or unevenly spaced slices to a regular grid with perpendicular axes
        #[arg(long, requires = "volume")]
        resample: bool,
    },
    /// JSON schema of a scene
    Schema,
    /// Every key, its values and defaults, as Markdown
    Reference,
    /// JSON schema of report.json
    ReportSchema,
    /// JSON schema of a study, which `cutis sweep` runs
    StudySchema,
}

/// A scene to run, and where.
#[derive(Clone, Debug, Group)]
pub(crate) struct RunArgs {
    /// Scene file (TOML)
    pub(crate) scene: PathBuf,
    /// Run folder [default: the scene's name with `-run`, in the current folder]
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) change: Change,
    /// Resume from the checkpoint in the run folder, or begin if a run with checkpoints has written
    /// none yet
    #[arg(long)]
    pub(crate) resume: bool,
    /// Print report.json on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

/// A volume, and how to read it.
#[derive(Clone, Debug, Group)]
pub(crate) struct VolumeArgs {
    /// Volume file, or a folder with a DICOM series
    #[arg(value_name = "VOLUME")]
    pub(crate) path: PathBuf,
    /// Number of the DICOM series, if the folder has several
    #[arg(long, value_name = "NUMBER")]
    series: Option<u32>,
    /// Resample tilted or unevenly spaced slices to a regular grid with perpendicular axes
    #[arg(long)]
    resample: bool,
}

impl VolumeArgs {
    pub(crate) fn options(&self) -> ReadOptions {
        ReadOptions { series: self.series, resample: self.resample }
    }
}

/// What `cutis resample` deforms.
#[derive(Clone, Debug, Group)]
pub(crate) struct ResampleArgs {
    /// Volume to deform, in the same world frame [default: the scene's own]
    #[arg(long, conflicts_with_all = ["labels", "field"])]
    volume: Option<PathBuf>,
    /// Label map to deform, in the same world frame, with nearest neighbors; 0 where the body left
    #[arg(long, conflicts_with = "field")]
    labels: Option<PathBuf>,
    /// Write the displacement field instead (.nrrd)
    #[arg(long, value_parser = one_of(&DIRECTIONS))]
    field: Option<FieldDirection>,
}

impl ResampleArgs {
    pub(crate) fn input(self) -> ResampleInput {
        match (self.labels, self.field) {
            (Some(labels), _) => ResampleInput::Labels(labels),
            (None, Some(direction)) => ResampleInput::Field(direction),
            (None, None) => ResampleInput::Volume(self.volume),
        }
    }
}

/// Options of `cutis tune`.
#[derive(Clone, Debug, Group)]
pub(crate) struct TuneArgs {
    /// Pick the most accurate setting that takes at most this time per frame, ms
    #[arg(long, value_name = "MS", conflicts_with = "error")]
    pub(crate) budget_ms: Option<f64>,
    /// Pick the cheapest setting with at most this error, % of the displacement
    /// [default: 5, or the best one that costs no more than the scene's own]
    #[arg(long, value_name = "PERCENT")]
    pub(crate) error: Option<f64>,
    /// Tuned copy of the scene [default: the scene's name with `-tuned`, in the current folder]
    #[arg(short, long)]
    pub(crate) out: Option<PathBuf>,
    /// Overwrite the copy if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Keep the whole body: do not pick a region around incisions and handles
    #[arg(long)]
    pub(crate) whole_body: bool,
    /// Skip the ablation: do not measure the scene without each of its parts
    #[arg(long)]
    pub(crate) settings_only: bool,
    /// Time limit for picking a setting, minutes; region and ablation may each take as long again
    #[arg(long, default_value_t = 5.0)]
    pub(crate) minutes: f64,
}

/// Options that change a scene.
#[derive(Clone, Debug, Default, Group)]
pub(crate) struct Change {
    /// Backend of the solver: auto, cpu, reference or gpu
    #[arg(long)]
    pub(crate) backend: Option<String>,
    /// GPU to use: part of its name, or its index in `cutis devices`
    #[arg(long, value_name = "NAME|INDEX")]
    pub(crate) adapter: Option<String>,
    /// Number of frames
    #[arg(long)]
    pub(crate) frames: Option<u32>,
    /// Set a key of the scene, for example solver.substeps=20
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<Override>,
    /// Remove a constraint kind from the scene
    #[arg(long, value_name = "KIND", value_parser = PossibleValuesParser::new(constraint_kinds()))]
    pub(crate) without: Vec<String>,
}

/// The name of a value on the command line, the value, and its description in the help.
type Named<T> = (&'static str, T, &'static str);

const MODES: [Named<SkinMode>; 3] = [
    ("paper", SkinMode::Paper, "The paper's rule, taken literally"),
    ("boundary", SkinMode::Boundary, "All faces between tissue and everything else"),
    ("exterior", SkinMode::Exterior, "The outer skin of the body"),
];

const SPLITS: [Named<Split>; 2] = [
    ("kuhn6", Split::Kuhn6, "Six tetrahedra around the main diagonal"),
    ("five", Split::Five, "Five tetrahedra, mirrored in every other cell"),
];

const DIRECTIONS: [Named<FieldDirection>; 2] = [
    ("to-rest", FieldDirection::ToRest, "From the deformed body to the scan, as ITK resamples images"),
    ("from-rest", FieldDirection::FromRest, "From the scan to the deformed body, for points and models"),
];

const SIDES: [Named<Side>; 6] = [
    ("anterior", Side::Anterior, "In front of the patient"),
    ("posterior", Side::Posterior, "Behind the patient"),
    ("left", Side::Left, "At the patient's left"),
    ("right", Side::Right, "At the patient's right"),
    ("superior", Side::Superior, "Above the head"),
    ("inferior", Side::Inferior, "Below the feet"),
];

/// Parses the name of one of the values.
fn one_of<T: Copy + Send + Sync>(values: &'static [Named<T>]) -> impl TypedValueParser<Value = T> {
    let names = values.iter().map(|&(name, _, help)| PossibleValue::new(name).help(help));
    PossibleValuesParser::new(names).try_map(|text| {
        let named = values.iter().find(|(name, ..)| *name == text);
        named.map(|&(_, value, _)| value).ok_or("not one of the values")
    })
}

fn angle(text: &str) -> Result<f64, String> {
    let angle = text.parse().ok().filter(|angle: &f64| angle.is_finite());
    angle.ok_or_else(|| format!("`{text}` must be an angle in degrees, for example 15 or -22.5"))
}

fn size(text: &str) -> Result<[usize; 3], String> {
    let parts: Result<Vec<usize>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    parts
        .ok()
        .and_then(|parts| <[usize; 3]>::try_from(parts).ok())
        .ok_or_else(|| format!("`{text}` must be three whole numbers nx,ny,nz, for example 128,128,96"))
}
