//! The uniform buffer of a view, prepared in double precision.

use bytemuck::{Pod, Zeroable};
use cutis_volume::Volume;
use nalgebra::{Matrix3, Vector3};

use crate::View;
use crate::field::Field;
use crate::rays::Rays;
use crate::shade::{DIRECTIONS, SKIN, Shader, TISSUE, decode};

/// `struct View` of the shader.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub struct ViewUniform {
    step: [f32; 3],
    threshold_hu: f32,
    steps_per_index: [f32; 3],
    occlusion: f32,
    index_per_spacing: [[f32; 4]; 3],
    toward: [f32; 3],
    depth_slope: f32,
    light: [f32; 3],
    depth_intercept: f32,
    half_way: [f32; 3],
    depth_spacing_mm: f32,
    skin: [f32; 3],
    skins_per_mm: f32,
    tissue: [[f32; 4]; 6],
    directions: [[f32; 4]; DIRECTIONS],
    reaches: [[f32; 4]; DIRECTIONS],
    depth_index: [[f32; 4]; 3],
    depth_per_spacing: [[f32; 4]; 3],
}

const _: () = assert!(size_of::<ViewUniform>() == cutis_shaders::render::VIEW_BYTES);

impl ViewUniform {
    pub fn new(volume: &Volume, view: &View<'_>, rays: &Rays<'_>, shader: &Shader<'_>) -> Self {
        let step = singles(&rays.step);
        let [directions, reaches] = [
            shader.directions,
            shader.directions.map(|direction| shader.index_per_mm * direction * shader.occlusion_mm),
        ]
        .map(|all| all.map(|direction| four(singles(&direction), 0.0)));
        let mut uniform = Self {
            step,
            threshold_hu: view.threshold_hu,
            steps_per_index: step.map(|step| if step == 0.0 { 0.0 } else { 1.0 / step }),
            occlusion: if shader.occlusion_mm == 0.0 { 0.0 } else { 1.0 },
            index_per_spacing: rows(&(shader.index_per_mm * shader.finest_mm), &Vector3::zeros()),
            toward: singles(&shader.toward),
            light: singles(&shader.light),
            half_way: singles(&(shader.light + shader.toward).normalize()),
            skin: decode(SKIN).into(),
            skins_per_mm: single(1.0 / shader.skin_mm),
            tissue: TISSUE.map(|(hu, color)| four(decode(color).into(), hu)),
            directions,
            reaches,
            ..Self::zeroed()
        };
        if let Some(depth) = view.depth {
            let field = Field::new(depth);
            let [from, to] = [volume, depth].map(|volume| volume.grid().affine);
            let mm_per_index = Matrix3::from_columns(&[from.step_mm(0), from.step_mm(1), from.step_mm(2)]);
            let origin = to.to_index(from.to_mm([0.0; 3].into()));
            let index_per_mm = field.index_per_mm();
            uniform.depth_slope = depth.slope();
            uniform.depth_intercept = depth.intercept();
            uniform.depth_spacing_mm = single(field.finest_mm());
            uniform.depth_index = rows(&(index_per_mm * mm_per_index), &origin.coords);
            uniform.depth_per_spacing = rows(&(index_per_mm * field.finest_mm()), &Vector3::zeros());
        }
        uniform
    }
}

/// The nearest `f32` that is neither infinite nor subnormal. Positions beyond 10³⁰ are outside
/// every grid, and changes below 10⁻³⁰ have no effect.
pub fn single(x: f64) -> f32 {
    if x.abs() >= 1e-30 { x.clamp(-1e30, 1e30) as f32 } else { 0.0 }
}

fn singles(v: &Vector3<f64>) -> [f32; 3] {
    v.map(single).into()
}

fn four([x, y, z]: [f32; 3], w: f32) -> [f32; 4] {
    [x, y, z, w]
}

/// The rows of an affine map.
fn rows(linear: &Matrix3<f64>, offset: &Vector3<f64>) -> [[f32; 4]; 3] {
    std::array::from_fn(|row| four(singles(&linear.row(row).transpose()), single(offset[row])))
}
