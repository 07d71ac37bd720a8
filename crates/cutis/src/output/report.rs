//! `report.json`: inputs, machine, times and results of a run. It has a version and a schema.

use std::collections::BTreeMap;
use std::path::Path;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use crate::output::number::fixed;

use crate::model::ScanTension;
use crate::model::constraints::coloring::Coloring;
use crate::model::constraints::kinds::report_name;
use crate::output::rest_report::{RestReport, StopReport};
use crate::output::step_report::{HandleReport, StepReport};
use crate::output::suture_report::SutureReport;
use crate::run::files;
use crate::{CostReport, Error, Scene};

/// Version of the report's layout. The number grows when a key changes its meaning or is removed.
pub const SCHEMA: &str = "cutis-report/1";

/// The whole report.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: String,
    /// Version of this program.
    pub cutis_version: String,
    /// End of the run in UTC, in the form of RFC 3339: `2026-11-27T01:12:03Z`. Empty in a report of
    /// an earlier version.
    #[serde(default)]
    pub finished_at: String,
    /// Wall time of the run up to its report, ms. 0 in a report of an earlier version.
    #[serde(default)]
    pub total_ms: f64,
    /// Machine that ran the scene.
    pub machine: Machine,
    /// Files that the run read.
    pub inputs: Vec<Input>,
    /// The scene with overrides applied and defaults filled in.
    pub scene: Scene,
    /// Backend of the solver.
    pub backend: Backend,
    /// Element counts.
    pub sizes: Sizes,
    /// The scene's table of materials, if its model uses one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub materials: Vec<MaterialRow>,
    /// Quality of the detected skin, if the scene needs the skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skin: Option<SkinQuality>,
    /// Tension of the skin in the scan, by constraint kind. A kind without tension is absent.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub tension: BTreeMap<String, ScanTension>,
    /// Normals and lines of tension of `constraints.membrane`, if the scene has it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub membrane: Option<MembraneReport>,
    /// Colors (groups without shared vertices) per constraint kind; a kind that the scene does not
    /// name is absent. In vertex block descent only the colors of the vertices, as `descent`.
    pub colors: BTreeMap<String, usize>,
    /// How the colors were found, with the same keys: `closed_form` from places in the lattice, or
    /// `greedy_cpu` by greedy coloring on the CPU, also if a GPU solves.
    #[serde(default)]
    pub colorings: BTreeMap<String, Coloring>,
    /// Memory of the solver on the host by part, bytes.
    pub memory: Vec<MemoryPart>,
    /// Memory of the solver on the GPU by part, bytes; empty on a CPU backend.
    pub device_memory: Vec<MemoryPart>,
    /// Bytes and time of the solver by part. A run without a report measures no times.
    #[serde(rename = "ledger")]
    pub costs: CostReport,
    /// Work of the GPU; none on a CPU backend.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub device: Option<DeviceWork>,
    /// Time and memory per stage.
    pub stages: Vec<Stage>,
    /// Time per frame.
    pub frames: Frames,
    /// The state of rest after the frames, if the run ends there. `wounds`, `sutures` and `handles`
    /// are those in it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rest: Option<RestReport>,
    /// The states of rest one after the other: after the frames, and after each thing that is done
    /// to the body later. The last one is `rest`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stops: Vec<StopReport>,
    /// What is done to the body, in the order of time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub steps: Vec<StepReport>,
    /// Opening of each incision, then of each excision. `initial` is the body at rest, also for a
    /// wound that is made later.
    pub wounds: Vec<Wound>,
    /// Opening of the first incision, if there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub wound: Option<Wound>,
    /// Volumes of the parts of the body that the cuts separate from the largest one, ml.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub free_pieces_ml: Vec<f64>,
    /// The sutures and the forces in them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sutures: Vec<SutureReport>,
    /// The handles and their forces.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub handles: Vec<HandleReport>,
    /// The resampled CT, if it was resampled as a whole: for the volume, or for pictures without a
    /// wound.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resample: Option<Resample>,
    /// Results of the model `chainmail`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chainmail: Option<ChainmailReport>,
    /// Constraint errors at the end. `None` with the model `chainmail`.
    pub residuals: Vec<KindResidual>,
    /// Largest distance that a vertex moved, mm.
    pub max_displacement_mm: f64,
    /// Largest distance that a vertex at the border of the region of interest moved, mm. None
    /// without a region that leaves something out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub border_displacement_mm: Option<f64>,
    /// Parts that the scene leaves out, which therefore cost nothing.
    pub left_out: Vec<String>,
    /// Warnings to the user.
    pub warnings: Vec<String>,
}

/// The machine that ran a scene.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Machine {
    /// Name of the processor.
    pub cpu: String,
    /// Logical cores.
    pub cores: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// A file that a run read.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Input {
    /// Path as the scene names it.
    pub path: String,
    /// SHA-256 of its bytes, hexadecimal.
    pub sha256: String,
}

/// The backend of the solver.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Backend {
    /// `cpu`, `reference` or `gpu`.
    pub name: String,
    /// Name of the GPU adapter; none on a CPU backend.
    pub adapter: Option<String>,
    /// `discrete`, `integrated`, `virtual`, `unknown` or `software`; none on a CPU backend.
    pub adapter_kind: Option<String>,
    /// Interface, name and version of the adapter's driver; none on a CPU backend.
    pub driver: Option<String>,
    /// Threads of the solver on the host.
    pub threads: usize,
    /// Why this backend was chosen.
    pub reason: String,
}

/// Element counts.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Sizes {
    /// Vertices per axis of the whole lattice.
    pub lattice: [usize; 3],
    /// Vertices in tissue.
    pub vertices: usize,
    /// Lattice edges in tissue.
    pub edges: usize,
    /// Tetrahedra in tissue.
    pub tets: usize,
    /// Skin triangles.
    pub skin_triangles: usize,
    /// Pairs of points on both sides of cuts without a width that touch or adhere in the end; 0
    /// without contact and adhesion.
    #[serde(default)]
    pub lip_pairs: usize,
    /// Vertices that the incisions removed from all constraints.
    pub removed_vertices: usize,
    /// Vertices that do not move.
    pub fixed_vertices: usize,
    /// Vertices of the body outside the region of interest; the other counts do not include them.
    #[serde(default)]
    pub frozen_vertices: usize,
    /// Tetrahedra of the body outside the region of interest.
    #[serde(default)]
    pub frozen_tets: usize,
}

/// A row of the table of materials, and the part of the body that it holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MaterialRow {
    /// Name of the tissue.
    pub name: String,
    /// Range of HU; none for any HU.
    pub hu: Option<[f64; 2]>,
    /// Range of depth below the skin, mm; none for any depth.
    pub depth_mm: Option<[f64; 2]>,
    /// Young's modulus of the tissue, Pa; its springs have four times as much.
    pub youngs_modulus_pa: f64,
    /// Bulk modulus, Pa.
    pub bulk_modulus_pa: f64,
    /// Vertices of this material.
    pub vertices: usize,
    /// Tetrahedra whose four vertices are of this material.
    pub tets: usize,
    /// Source of the values.
    pub source: Option<String>,
}

/// Quality of the detected skin, before the incisions.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct SkinQuality {
    /// Triangles.
    pub triangles: usize,
    /// Edges of only one triangle, except where the scan ends.
    pub open_edges: usize,
    /// Edges of more than two triangles.
    pub non_manifold_edges: usize,
    /// Parts that share no vertex.
    pub components: usize,
    /// Share of the tissue's boundary that is not outer skin (lungs, bowel, table).
    pub enclosed_share: f64,
    /// Share of the iso-surface that skin covers.
    pub coverage: f64,
}

impl From<&cutis_mesh::SkinReport> for SkinQuality {
    fn from(report: &cutis_mesh::SkinReport) -> Self {
        Self {
            triangles: report.triangles,
            open_edges: report.open_edges - report.open_edges_on_box,
            non_manifold_edges: report.non_manifold_edges,
            components: report.components,
            enclosed_share: report.enclosed_share,
            coverage: report.coverage,
        }
    }
}

/// Normals and lines of tension of the whole skin, before the incisions.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MembraneReport {
    /// Triangles of the skin.
    pub triangles: usize,
    /// Share of the skin's area, 0 to 1, where the lines have a direction: their weight is above ½.
    /// The area of a triangle is that of its projection on the tangent plane of the smooth skin.
    /// None if the scene gives no directions, so that the skin is isotropic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coverage: Option<f64>,
    /// Triangles whose normal is only the mean of the facets around them, because the tissue is
    /// thinner than the blur from which normals follow.
    pub normals_from_facets: usize,
}

impl MembraneReport {
    /// One line about the coverage. A warning reports normals that are not those of the CT.
    pub fn summary(&self) -> String {
        match self.coverage {
            Some(coverage) => format!("a direction on {:.1} % of the skin", 100.0 * coverage),
            None => "no direction: the skin is isotropic".to_owned(),
        }
    }
}

/// Memory of one part of the solver.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct MemoryPart {
    /// `vertices`, a constraint kind, `multipliers`, `incidences`, …, or `rest`: a search for the
    /// state of rest, about.
    pub part: String,
    /// Bytes.
    pub bytes: usize,
}

impl MemoryPart {
    /// The part of a search for the state of rest.
    pub const REST: &str = "rest";
}

impl From<&cutis_solver::MemoryPart> for MemoryPart {
    fn from(part: &cutis_solver::MemoryPart) -> Self {
        Self { part: report_name(part.name).into(), bytes: part.bytes }
    }
}

/// Work of a GPU for a run, from the first frame to the last output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct DeviceWork {
    /// Kernels compiled.
    pub kernels: u64,
    /// Submitted passes.
    pub submits: u64,
    /// Dispatches of these passes.
    pub dispatches: u64,
    /// Reads from the GPU.
    pub readbacks: u64,
    /// Bytes of these reads.
    pub readback_bytes: u64,
}

/// Time and memory of one stage.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Stage {
    /// Name of the stage.
    pub name: String,
    /// Wall time, ms.
    pub ms: f64,
    /// Where its heavy part ran: `cpu` or `gpu`.
    pub on: String,
    /// Largest resident memory of the process during the stage, bytes. None where the system does
    /// not tell; Linux does.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_bytes: Option<u64>,
}

/// Time per frame.
#[derive(Clone, Debug, Default, Serialize, Deserialize, JsonSchema)]
pub struct Frames {
    /// Number of frames that this run computed.
    pub count: u32,
    /// Mean wall time, ms; 0 without frames.
    pub ms_mean: f64,
    /// Shortest wall time, ms; 0 without frames.
    pub ms_min: f64,
}

/// Opening of an incision, mm: distance between its lips.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Wound {
    /// Mean opening before the first frame.
    pub initial_mm: f64,
    /// Mean opening after the last frame.
    pub final_mm: f64,
    /// Opening in the middle of the slit, after the last frame.
    pub mid_mm: f64,
    /// Opening in the middle of the slit, before the first frame.
    pub initial_mid_mm: f64,
}

impl Wound {
    /// One line for people.
    #[must_use]
    pub fn summary(&self) -> String {
        let [initial, last, mid] = [self.initial_mm, self.final_mm, self.mid_mm].map(|mm| fixed(mm, 2));
        format!("wound: {initial} mm -> {last} mm ({mid} mm in the middle)")
    }
}

/// The resampled CT.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Resample {
    /// Voxels of the deformed body that moved.
    pub moved_voxels: u64,
    /// Voxels inside two or more deformed tetrahedra: the body overlaps itself there.
    pub folds: u64,
    /// Voxels that became air because the body moved away or an incision removed it.
    pub vacated_voxels: u64,
}

/// Results of the model `chainmail`. The times of its parts are in the cost report.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ChainmailReport {
    /// Elements (vertices of the cut body) that have left their rest positions.
    pub moved: usize,
    /// Links beyond their limits; 0 unless drags pull on elements that cannot follow.
    pub violated_links: usize,
    /// Links that the incisions have cut, including those before a resumed checkpoint.
    pub cut_links: usize,
    /// System energy after the last drag and before the relaxation that followed, mm²: half the sum
    /// of the squared differences of links from rest.
    pub energy_before: f64,
    /// System energy at the end, mm².
    pub energy_after: f64,
    /// Sweeps of relaxation in this run.
    pub relax_sweeps: u64,
    /// How often relaxation changed a coordinate of an element.
    pub relax_moves: u64,
    /// Whether relaxation has ended.
    pub settled: bool,
}

impl ChainmailReport {
    /// Names and values for the report for people.
    fn table(&self) -> Vec<(&'static str, String)> {
        vec![
            ("elements that moved", self.moved.to_string()),
            ("links beyond their limits", self.violated_links.to_string()),
            ("links cut", self.cut_links.to_string()),
            ("system energy after the last drag", format!("{:.4e} mm²", self.energy_before)),
            ("system energy at the end", format!("{:.4e} mm²", self.energy_after)),
            ("sweeps of relaxation", self.relax_sweeps.to_string()),
            ("relaxed to the end", if self.settled { "yes" } else { "no" }.into()),
        ]
    }
}

/// Relative errors of one constraint kind.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KindResidual {
    /// Constraint kind.
    pub kind: String,
    /// Root mean square of C over the rest size.
    pub rms: f64,
    /// Largest |C| over the rest size.
    pub max: f64,
}

impl From<&cutis_solver::Residual> for KindResidual {
    fn from(residual: &cutis_solver::Residual) -> Self {
        Self { kind: report_name(residual.name).into(), rms: residual.rms, max: residual.max }
    }
}

impl Report {
    /// One line per constraint kind with the tension of the skin in the scan, and one about its
    /// lines.
    pub fn tension_summary(&self) -> Vec<String> {
        let tension = self.tension.iter().map(|(kind, tension)| format!("tension, {kind}: {tension}"));
        let lines = self.membrane.iter().map(|membrane| format!("lines of tension: {}", membrane.summary()));
        tension.chain(lines).collect()
    }

    /// Title and facts of a model that has results of its own; none for other models.
    pub(crate) fn model_table(&self) -> Option<(&'static str, Vec<(&'static str, String)>)> {
        Some(("ChainMail", self.chainmail.as_ref()?.table()))
    }

    /// One line about the results of a model that has results of its own; none for other models.
    pub fn model_summary(&self) -> Option<String> {
        let chainmail = self.chainmail.as_ref()?;
        Some(format!(
            "chainmail: {} elements moved, {} links beyond their limits, {} sweeps of relaxation{}",
            chainmail.moved,
            chainmail.violated_links,
            chainmail.relax_sweeps,
            if chainmail.settled { " (settled)" } else { "" }
        ))
    }

    /// Writes `report.json`.
    ///
    /// # Errors
    /// [`Error::File`] if the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        let text = serde_json::to_string_pretty(self).map_err(|e| Error::File {
            path: path.into(),
            action: "write",
            why: e.to_string(),
        })?;
        files::write(path, text.as_bytes())
    }

    /// Returns the JSON schema of the report.
    pub fn json_schema() -> serde_json::Value {
        schemars::schema_for!(Report).to_value()
    }
}

impl Machine {
    /// Describes this machine.
    pub fn here() -> Self {
        let cpu = std::fs::read_to_string("/proc/cpuinfo")
            .ok()
            .and_then(|text| {
                let line = text.lines().find(|line| line.starts_with("model name"))?;
                Some(line.split_once(':')?.1.trim().to_owned())
            })
            .unwrap_or_else(|| "unknown".into());
        let cores = std::thread::available_parallelism().map_or(1, |n| n.get());
        Self { cpu, cores, system: format!("{} {}", std::env::consts::OS, std::env::consts::ARCH) }
    }
}
