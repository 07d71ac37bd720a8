//! The flags of the module. The names follow the habits of 3D Slicer.

use std::path::PathBuf;

use clap::Parser;
use clap::builder::PossibleValuesParser;

/// Parts of the body with presets of materials and of skin tension.
const PARTS: [&str; 3] = ["trunk", "limb", "head"];
const BACKENDS: [&str; 3] = ["auto", "cpu", "gpu"];

/// The call of the module by 3D Slicer.
#[derive(Debug, Parser)]
#[command(name = "cutis", version, disable_help_subcommand = true)]
pub(super) struct ModuleArgs {
    /// CT to cut, in Hounsfield units
    #[arg(long = "inputVolume", value_name = "FILE")]
    pub(super) input_volume: PathBuf,
    /// Path of the incision on the skin: a curve, a line or a list of points
    #[arg(long, value_name = "FILE")]
    pub(super) incision: Option<PathBuf>,
    /// Depth of the incision below the skin, mm
    #[arg(long, value_name = "MM", default_value_t = 20.0)]
    pub(super) depth: f64,
    /// Part of the body, for the materials and the tension of the skin
    #[arg(long = "bodyPart", value_parser = PossibleValuesParser::new(PARTS), default_value = "trunk")]
    pub(super) body_part: String,
    /// Distance between the vertices of the body, mm
    #[arg(long, value_name = "MM", default_value_t = 4.0)]
    pub(super) spacing: f64,
    /// Device that computes: the best one, all processor cores, or a GPU
    #[arg(long, value_parser = PossibleValuesParser::new(BACKENDS), default_value = "auto")]
    pub(super) backend: String,
    /// Scene of Cutis (TOML) in place of body part and spacing. Its volume is replaced, and its
    /// incisions too if a path is given
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,
    /// Deformed CT
    #[arg(long = "outputVolume", value_name = "FILE")]
    pub(super) output_volume: Option<PathBuf>,
    /// Displacement as a transform by a grid. Apply it to volumes, segmentations and markups of the
    /// input
    #[arg(long = "outputTransform", value_name = "FILE")]
    pub(super) output_transform: Option<PathBuf>,
    /// Deformed skin
    #[arg(long = "outputModel", value_name = "FILE")]
    pub(super) output_model: Option<PathBuf>,
    /// Folder for report.html and the other files of the run
    #[arg(long = "runFolder", value_name = "FOLDER")]
    pub(super) run_folder: Option<PathBuf>,
    /// File for results that are single numbers; set by 3D Slicer
    #[arg(long = "returnparameterfile", value_name = "FILE", hide = true)]
    pub(super) return_parameter_file: Option<PathBuf>,
    /// For modules that share the memory of 3D Slicer; ignored
    #[arg(long = "processinformationaddress", value_name = "ADDRESS", hide = true)]
    process_information_address: Option<String>,
}
