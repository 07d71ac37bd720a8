//! The lattice of a scene, even or graded.

use cutis_mesh::{Grading, Lattice, Planes};
use cutis_volume::sample::{self, LatticeSize};
use cutis_volume::{Grid, Volume};
use nalgebra::{Point3, Vector3};

use super::{BodySections, memory};
use crate::Error;
use crate::scene::{IncisionSection, LatticeSection, Zone};

impl LatticeSection {
    /// The size of the lattice that the section describes.
    fn size(&self) -> LatticeSize {
        match (self.vertices, self.spacing_mm) {
            (Some(vertices), _) => LatticeSize::Vertices(vertices),
            (None, Some(spacing)) => LatticeSize::SpacingMm(spacing),
            (None, None) => LatticeSize::Native,
        }
    }
}

/// The lattice of a scene over its CT.
///
/// # Errors
/// [`Error`] for a lattice that does not fit the CT.
pub(crate) fn lattice(sections: &BodySections<'_>, volume: &Volume) -> Result<Lattice, Error> {
    let (file, section) = (sections.file, sections.lattice);
    let even = sample::lattice_grid(volume.grid(), section.size())
        .map_err(|error| memory::lattice_size(sections, volume.grid(), error))?;
    let lattice = match &section.grading {
        None => Lattice::new(even, section.split),
        Some(grading) => {
            let Some(zone) = grading.zone() else {
                return Err(file.bad_key("lattice.grading", "", "it has no zone"));
            };
            let fine = fine_zone(sections, zone, &even);
            let steps = Grading { growth: grading.growth, coarsest: grading.coarsest };
            let planes = Planes::new(&even, fine, &steps).map_err(file.blame("lattice.grading"))?;
            Lattice::graded(even, section.split, planes)
        }
    };
    lattice.map_err(file.blame("lattice"))
}

/// Points along each axis that a lattice would have with the spacing of its fine zone everywhere.
pub(crate) fn even_shape(lattice: &Lattice) -> [usize; 3] {
    let even = |planes: &Planes| {
        planes.axes().each_ref().map(|axis| axis.last().map_or(0, |last| *last as usize) + 1)
    };
    lattice.planes().map_or(lattice.grid().shape, even)
}

/// Bounds of the fine zone along each axis of the lattice, in steps of the even lattice.
fn fine_zone(sections: &BodySections<'_>, zone: Zone, even: &Grid) -> [[f64; 2]; 3] {
    let mut hull = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    let mut add = |mm: [f64; 3], radius_mm: f64| {
        let index = even.affine.to_index(mm.into());
        for axis in 0..3 {
            // Steps per millimeter in the direction in which the index rises fastest.
            let per_mm = Vector3::from_fn(|world, _| {
                even.affine.to_index(Point3::origin() + Vector3::ith(world, 1.0))[axis]
                    - even.affine.to_index(Point3::origin())[axis]
            });
            let reach = radius_mm * per_mm.norm();
            hull[axis] = [hull[axis][0].min(index[axis] - reach), hull[axis][1].max(index[axis] + reach)];
        }
    };
    match zone {
        Zone::Box(min, max) => {
            let corner =
                |n: usize| std::array::from_fn(|axis| if n >> axis & 1 == 0 { min[axis] } else { max[axis] });
            (0..8).for_each(|n| add(corner(n), 0.0));
        }
        Zone::Around(around) => {
            for incision in sections.incisions {
                for point in incision.path() {
                    add(point, around + incision.depth_mm);
                }
            }
            for undermining in &sections.underminings {
                let incision = sections.incisions.get(undermining.wound);
                let excision = undermining.wound.checked_sub(sections.incisions.len());
                let outline = excision.map(|n| sections.excisions[n].path_mm.clone());
                for point in incision.map(IncisionSection::path).or(outline).unwrap_or_default() {
                    add(point, around + undermining.distance_mm + undermining.depth_mm);
                }
            }
            for excision in sections.excisions {
                for &point in &excision.path_mm {
                    add(point, around + excision.depth_mm);
                }
            }
            sections.handles.iter().for_each(|handle| add(handle.center_mm(), around + handle.radius_mm));
        }
    }
    hull
}
