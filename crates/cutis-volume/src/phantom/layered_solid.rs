//! Unions of solids with layers of Hounsfield units, painted one over the other along rows of
//! sample points.

use super::outline::Outline;
use super::random::Field;
use super::solid::{Bounds, Solid};

/// A layer of material. It begins `inset_mm` below the surface and ends at the next layer.
#[derive(Clone, Copy)]
pub(super) struct Layer {
    inset_mm: f32,
    hu: f32,
    grain_hu: f32,
}

/// A layer of uniform Hounsfield units.
pub(super) const fn layer(inset_mm: f32, hu: f32) -> Layer {
    grainy(inset_mm, hu, 0.0)
}

/// A layer whose Hounsfield units vary in space by up to `grain_hu`.
pub(super) const fn grainy(inset_mm: f32, hu: f32, grain_hu: f32) -> Layer {
    Layer { inset_mm, hu, grain_hu }
}

/// A union of solids, filled with layers from the surface inwards.
pub(super) struct LayeredSolid {
    solids: Vec<(Solid, Bounds)>,
    layers: Vec<Layer>,
    wobble_mm: f32,
    cavity_margin_mm: Option<f32>,
    above: Option<(usize, f32)>,
}

impl LayeredSolid {
    pub(super) fn new(solids: impl IntoIterator<Item = Solid>, layers: impl Into<Vec<Layer>>) -> Self {
        let solids = solids.into_iter().map(|solid| {
            let bounds = solid.bounds();
            (solid, bounds)
        });
        Self {
            solids: solids.collect(),
            layers: layers.into(),
            wobble_mm: 0.0,
            cavity_margin_mm: None,
            above: None,
        }
    }

    /// Moves the surface in or out by up to `wobble_mm`, smoothly varying in space.
    pub(super) fn wobbly(self, wobble_mm: f32) -> Self {
        Self { wobble_mm, ..self }
    }

    /// Restricts the solid to points at least `margin_mm` inside the body cavity.
    pub(super) fn in_cavity(self, margin_mm: f32) -> Self {
        Self { cavity_margin_mm: Some(margin_mm), ..self }
    }

    /// Restricts the solid to points above `level_mm` along `axis` (1 or 2).
    pub(super) fn above(self, axis: usize, level_mm: f32) -> Self {
        Self { above: Some((axis, level_mm)), ..self }
    }
}

/// A layered solid with those of its solids that reach one box of the scan.
pub(super) struct InBox<'a> {
    whole: &'a LayeredSolid,
    solids: Vec<&'a (Solid, Bounds)>,
}

impl InBox<'_> {
    fn reaches_row(&self, y: f32, blend_mm: f32) -> bool {
        self.solids.iter().any(|(_, bounds)| bounds.covers(1, y, self.whole.wobble_mm + blend_mm))
    }
}

/// The layered solids that reach the box between two corners, in painting order. Edges are blended
/// over `blend_mm`.
pub(super) fn in_box(all: &[LayeredSolid], [low, high]: [[f32; 3]; 2], blend_mm: f32) -> Vec<InBox<'_>> {
    let reaches = |whole: &LayeredSolid, bounds: &Bounds| {
        let margin = whole.wobble_mm + blend_mm;
        (0..3).all(|axis| high[axis] >= bounds.low[axis] - margin && low[axis] <= bounds.high[axis] + margin)
    };
    let cut = all.iter().map(|whole| InBox {
        whole,
        solids: whole.solids.iter().filter(|(_, bounds)| reaches(whole, bounds)).collect(),
    });
    cut.filter(|in_box| !in_box.solids.is_empty()).collect()
}

/// The layered solids that reach the axial plane at height `z`, in painting order.
pub(super) fn in_plane(all: &[LayeredSolid], z: f32, blend_mm: f32) -> Vec<InBox<'_>> {
    const ALL: f32 = f32::INFINITY;
    in_box(all, [[-ALL, -ALL, z], [ALL, ALL, z]], blend_mm)
}

/// A row of sample points along x, with buffers for painting it.
pub(super) struct SampleRow {
    xs: Vec<f32>,
    step: f32,
    blend_mm: f32,
    hu: Vec<f32>,
    distance: Vec<f32>,
    cavity: Vec<f32>,
    wobble: Vec<f32>,
    grain: Vec<f32>,
    columns: Vec<f32>,
}

/// The body cavity and the random fields that all rows share.
pub(super) struct Surroundings {
    pub(super) cavity: Outline,
    pub(super) wobble: Field,
    pub(super) grain: Field,
}

impl SampleRow {
    /// Creates a row with the sample points `xs`, ascending with distance `step`. Edges are blended
    /// over `blend_mm`.
    pub(super) fn new(xs: &[f32], step: f32, blend_mm: f32) -> Self {
        let zeros = || vec![0.0; xs.len()];
        Self {
            xs: xs.to_vec(),
            step,
            blend_mm,
            hu: zeros(),
            distance: vec![f32::INFINITY; xs.len()],
            cavity: zeros(),
            wobble: zeros(),
            grain: zeros(),
            columns: Vec::new(),
        }
    }

    /// Hounsfield units at one point, for a row of one sample.
    pub(super) fn paint_point(
        &mut self,
        solids: &[InBox<'_>],
        around: &Surroundings,
        [x, y, z]: [f32; 3],
        background_hu: f32,
    ) -> f32 {
        self.xs[0] = x;
        self.paint(solids, around, y, z, background_hu)[0]
    }

    /// Hounsfield units of the row at `(y, z)`: the background with the solids painted over it in
    /// order.
    pub(super) fn paint(
        &mut self,
        solids: &[InBox<'_>],
        around: &Surroundings,
        y: f32,
        z: f32,
        background_hu: f32,
    ) -> &[f32] {
        self.hu.fill(background_hu);
        if !solids.iter().any(|solid| solid.reaches_row(y, self.blend_mm)) {
            return &self.hu;
        }
        self.cavity.fill(f32::INFINITY);
        around.cavity.lower_row(&self.xs, y, z, &mut self.cavity);
        around.wobble.fill_row(&self.xs, y, z, &mut self.columns, &mut self.wobble);
        around.grain.fill_row(&self.xs, y, z, &mut self.columns, &mut self.grain);
        for solid in solids {
            self.paint_solid(solid, y, z);
        }
        &self.hu
    }

    fn paint_solid(&mut self, in_box: &InBox<'_>, y: f32, z: f32) {
        let whole = in_box.whole;
        let scale = 1.0 / self.blend_mm;
        let side = match whole.above {
            Some((axis, level)) => coverage(level - if axis == 1 { y } else { z }, scale),
            None => 1.0,
        };
        if side == 0.0 {
            return;
        }
        let margin = whole.wobble_mm + self.blend_mm;
        let mut touched = self.xs.len()..0;
        for (solid, bounds) in &in_box.solids {
            if bounds.covers(1, y, margin) && bounds.covers(2, z, margin) {
                let span = self.span(bounds.low[0] - margin, bounds.high[0] + margin);
                solid.lower_row(&self.xs[span.clone()], y, z, &mut self.distance[span.clone()]);
                touched = touched.start.min(span.start)..touched.end.max(span.end);
            }
        }
        if touched.is_empty() {
            return;
        }
        let distance = &mut self.distance[touched.clone()];
        let hu = &mut self.hu[touched.clone()];
        let [cavity, wobble, grain] =
            [&self.cavity, &self.wobble, &self.grain].map(|values| &values[touched.clone()]);
        for (d, w) in distance.iter_mut().zip(wobble) {
            *d += whole.wobble_mm * w;
        }
        let mut outer: Option<Layer> = None;
        for &layer in &whole.layers {
            for i in 0..hu.len() {
                let share = match whole.cavity_margin_mm {
                    Some(margin) => side * coverage(cavity[i] + margin, scale),
                    None => side,
                };
                let below = outer.map_or(hu[i], |outer| outer.hu + outer.grain_hu * grain[i]);
                let value = layer.hu + layer.grain_hu * grain[i];
                hu[i] += share * coverage(distance[i] + layer.inset_mm, scale) * (value - below);
            }
            outer = Some(layer);
        }
        distance.fill(f32::INFINITY);
    }

    /// The indices of the sample points from `low` to `high` in mm.
    fn span(&self, low: f32, high: f32) -> std::ops::Range<usize> {
        let Some(&first) = self.xs.first() else { return 0..0 };
        let index = |x: f32| ((x - first) / self.step).max(0.0) as usize;
        let end = if high < first { 0 } else { (index(high) + 2).min(self.xs.len()) };
        index(low).min(end)..end
    }
}

/// Share of a sample that is inside a surface at signed distance `d`. It is a linear ramp of width
/// `1 / scale`.
#[inline(always)]
fn coverage(d: f32, scale: f32) -> f32 {
    (0.5 - d * scale).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::super::profile::Profile;
    use super::super::solid::Blob;
    use super::*;

    fn paint(solid: LayeredSolid) -> Vec<f32> {
        let xs: Vec<f32> = (0..81).map(|i| i as f32 - 40.0).collect();
        let cavity = Outline {
            side: Profile::new([15.0; 7]),
            front: Profile::new([15.0; 7]),
            back: Profile::new([15.0; 7]),
            squareness: 0.0,
        };
        let around = Surroundings { cavity, wobble: Field::new(1, 1, 9.0), grain: Field::new(1, 2, 9.0) };
        let solids = [solid];
        SampleRow::new(&xs, 1.0, 1.0)
            .paint(&in_plane(&solids, 0.5, 1.0), &around, 0.25, 0.5, -1000.0)
            .to_vec()
    }

    fn ball(radius: f32) -> Solid {
        Solid::Blob(Blob::new([0.0; 3], [radius; 3]))
    }

    #[test]
    fn layers_follow_the_surface() {
        let row = paint(LayeredSolid::new([ball(20.0)], [layer(0.0, 10.0), layer(4.0, 200.0)]));
        assert_eq!([row[0], row[40], row[40 + 18], row[40 - 18]], [-1000.0, 200.0, 10.0, 10.0]);
        assert!(row[60] > -1000.0 && row[60] < 10.0, "the edge is blended: {}", row[60]);
    }

    #[test]
    fn cavity_and_level_restrict_the_solid() {
        let row = paint(LayeredSolid::new([ball(20.0)], [layer(0.0, 10.0)]).in_cavity(2.0));
        assert_eq!([row[40 + 12], row[40 + 14]], [10.0, -1000.0]);
        let below = paint(LayeredSolid::new([ball(20.0)], [layer(0.0, 10.0)]).above(1, 5.0));
        assert!(below.iter().all(|&hu| hu == -1000.0));
        let above = paint(LayeredSolid::new([ball(20.0)], [layer(0.0, 10.0)]).above(2, -5.0));
        assert_eq!(above[40], 10.0);
    }

    #[test]
    fn overlapping_solids_have_no_wall_between_them() {
        // Two overlapping balls with a thick wall.
        let at = |x: f32| Solid::Blob(Blob::new([x, 0.0, 0.0], [12.0; 3]));
        let row = paint(LayeredSolid::new([at(-8.0), at(8.0)], [layer(0.0, 50.0), layer(3.0, 0.0)]));
        assert_eq!([row[40], row[40 + 18], row[40 - 18]], [0.0, 50.0, 50.0]);
    }
}
