//! Coloring of constraints over any mesh, on the GPU.

use cutis_coloring::{ColoringError, Groups, Tuples};
use cutis_gpu::{BindGroup, Buffer, Gpu, GpuError, Kernel};
use cutis_shaders::coloring as shader;

/// Rounds per submission. The host waits for the device after each submission.
const ROUNDS: usize = 8;

/// An error of [`color`].
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuColoringError {
    /// The constraints are invalid.
    #[error(transparent)]
    Coloring(#[from] ColoringError),
    /// The device failed, or its limits are too small.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// More colors than groups can have.
    #[error("the constraints need {colors} colors; at most {most} are possible")]
    TooManyColors {
        /// Number of colors so far.
        colors: u32,
        /// The largest allowed number.
        most: u32,
    },
}

/// Divides constraints over `N` vertices into groups in which no two share a vertex.
///
/// The result is that of [`greedy`](cutis_coloring::greedy) for the constraints in a random but
/// fixed order, so it is the same on every device. It needs a few colors more than `greedy` does
/// for a mesh that is in order.
///
/// # Method
/// Parallel greedy coloring by priorities (Jones and Plassmann, SIAM J. Sci. Comput. 14, 1993), on
/// the constraints and vertices themselves: no graph of constraints is built. Each vertex has a
/// mask of 128 colors and the highest priority of its constraints without a color. In each round
/// the constraints with the highest priority at all of their vertices take the lowest color that
/// is free there. When all 128 colors are taken at a vertex, its other constraints wait for the
/// next 128.
///
/// The device holds 20 bytes per vertex, and the vertices and the color of each constraint.
///
/// # Errors
/// [`GpuColoringError::Coloring`] for invalid constraints, [`GpuColoringError::Gpu`], and
/// [`GpuColoringError::TooManyColors`] for more than 65,536 colors.
pub fn color<const N: usize>(
    gpu: &Gpu,
    constraints: &[[u32; N]],
    vertex_count: usize,
) -> Result<Groups, GpuColoringError> {
    check(constraints, vertex_count)?;
    if constraints.is_empty() {
        return Ok(Groups::from_colors(&[])?);
    }
    let mut coloring = Coloring::new(gpu, Tuples::of(constraints), vertex_count)?;
    let mut deferred = false;
    loop {
        let [left, more] = coloring.rounds(gpu)?;
        deferred |= more;
        match (left, deferred) {
            (true, _) => {}
            (false, true) => {
                coloring.next_colors(gpu)?;
                deferred = false;
            }
            (false, false) => break,
        }
    }
    let mut colors = Vec::with_capacity(constraints.len());
    for part in &coloring.parts {
        let found = gpu.read(&part.colors, 0..part.colors.len())?;
        for color in found {
            let too_many = |_| GpuColoringError::TooManyColors { colors: color, most: MOST };
            colors.push(u16::try_from(color).map_err(too_many)?);
        }
    }
    Ok(Groups::from_colors(&colors)?)
}

/// The largest number of colors.
const MOST: u32 = 1 << 16;

/// Refuses constraints that name a vertex twice, or one that does not exist.
fn check<const N: usize>(constraints: &[[u32; N]], vertex_count: usize) -> Result<(), ColoringError> {
    for (constraint, vertices) in constraints.iter().enumerate() {
        for (n, &vertex) in vertices.iter().enumerate() {
            if vertex as usize >= vertex_count {
                return Err(ColoringError::VertexOutOfRange { constraint, vertex, vertex_count });
            }
            if vertices[..n].contains(&vertex) {
                return Err(ColoringError::RepeatedVertex { constraint, vertex });
            }
        }
    }
    let (count, limit) = (constraints.len(), u32::MAX as usize);
    if count > limit { Err(ColoringError::TooManyConstraints { count, limit }) } else { Ok(()) }
}

/// The state on the device.
struct Coloring {
    arity: u32,
    /// Color that bit 0 of the masks stands for.
    base: u32,
    propose: Kernel,
    choose: Kernel,
    resume: Kernel,
    clear_highest: Kernel,
    clear_masks: Kernel,
    parts: Vec<Part>,
    /// Parts of the vertices that fit a dispatch.
    vertices: Vec<VertexPart>,
    /// Whether a constraint is left, and whether one is deferred.
    found: Buffer<u32>,
}

/// Constraints that fit a binding.
struct Part {
    first: u32,
    colors: Buffer<u32>,
    settings: Buffer<[u32; 4]>,
    propose: BindGroup,
    choose: BindGroup,
    resume: BindGroup,
}

struct VertexPart {
    count: usize,
    clear_highest: BindGroup,
    clear_masks: BindGroup,
}

impl Coloring {
    fn new(gpu: &Gpu, tuples: Tuples<'_>, vertex_count: usize) -> Result<Self, GpuError> {
        let source = shader::color();
        let kernel = |entry: &str| gpu.kernel(entry, &source, entry);
        let [propose, choose, resume] =
            [kernel(shader::PROPOSE)?, kernel(shader::CHOOSE)?, kernel(shader::RESUME)?];
        let source = shader::clear();
        let kernel = |entry: &str| gpu.kernel(entry, &source, entry);
        let [clear_highest, clear_masks] = [kernel(shader::CLEAR_HIGHEST)?, kernel(shader::CLEAR_MASKS)?];
        let highest = gpu.zeroed::<u32>("highest priorities", vertex_count)?;
        let masks = gpu.zeroed::<[u32; 4]>("masks of colors", vertex_count)?;
        let found = gpu.zeroed::<u32>("constraints without a color", 2)?;
        let arity = tuples.arity;
        let mut parts = Vec::new();
        let mut first = 0;
        for vertices in tuples.vertices.chunks(arity * gpu.chunk_len(arity * size_of::<u32>())) {
            let count = vertices.len() / arity;
            let tuples = gpu.buffer("constraints to color", vertices)?;
            let colors = gpu.buffer("colors", &vec![shader::LEFT; count])?;
            let settings = gpu.uniform("settings of a coloring", &[arity as u32, first, 0, 0])?;
            let bind = |kernel: &Kernel, used: &[u32]| {
                let all = [
                    (0, tuples.whole()),
                    (1, colors.whole()),
                    (2, highest.whole()),
                    (3, masks.whole()),
                    (4, found.whole()),
                    (5, settings.whole()),
                ];
                let bindings: Vec<_> = all.into_iter().filter(|(n, _)| used.contains(n)).collect();
                gpu.bind(kernel, 0, &bindings)
            };
            let groups =
                [bind(&propose, &[0, 1, 2, 5])?, bind(&choose, &[0, 1, 2, 3, 4, 5])?, bind(&resume, &[1])?];
            let [propose, choose, resume] = groups;
            parts.push(Part { first, colors, settings, propose, choose, resume });
            first += count as u32;
        }
        let step = gpu.chunk_len(size_of::<[u32; 4]>());
        let mut vertices = Vec::new();
        for start in (0..vertex_count).step_by(step) {
            let range = start..vertex_count.min(start + step);
            vertices.push(VertexPart {
                count: range.len(),
                clear_highest: gpu.bind(&clear_highest, 0, &[(0, highest.range(range.clone()))])?,
                clear_masks: gpu.bind(&clear_masks, 0, &[(1, masks.range(range))])?,
            });
        }
        let arity = arity as u32;
        Ok(Self {
            arity,
            base: 0,
            propose,
            choose,
            resume,
            clear_highest,
            clear_masks,
            parts,
            vertices,
            found,
        })
    }

    /// Runs some rounds. Returns whether a constraint was left in one of them, and whether one was
    /// deferred.
    fn rounds(&self, gpu: &Gpu) -> Result<[bool; 2], GpuError> {
        gpu.write(&self.found, 0, &[0, 0])?;
        let mut pass = gpu.pass("coloring");
        for _ in 0..ROUNDS {
            for part in &self.vertices {
                pass.dispatch(&self.clear_highest, &[&part.clear_highest], part.count);
            }
            for part in &self.parts {
                pass.dispatch(&self.propose, &[&part.propose], part.colors.len());
            }
            for part in &self.parts {
                pass.dispatch(&self.choose, &[&part.choose], part.colors.len());
            }
        }
        pass.submit()?;
        let found = gpu.read(&self.found, 0..2)?;
        Ok([found[0] != 0, found[1] != 0])
    }

    /// Prepares the masks for the next colors.
    fn next_colors(&mut self, gpu: &Gpu) -> Result<(), GpuColoringError> {
        self.base += shader::MASK_COLORS;
        if self.base >= MOST {
            return Err(GpuColoringError::TooManyColors { colors: self.base, most: MOST });
        }
        for part in &self.parts {
            gpu.write(&part.settings, 0, &[[self.arity, part.first, self.base, 0]])?;
        }
        let mut pass = gpu.pass("next colors");
        for part in &self.vertices {
            pass.dispatch(&self.clear_masks, &[&part.clear_masks], part.count);
        }
        for part in &self.parts {
            pass.dispatch(&self.resume, &[&part.resume], part.colors.len());
        }
        Ok(pass.submit()?)
    }
}
