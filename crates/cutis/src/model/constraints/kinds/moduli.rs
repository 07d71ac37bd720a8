//! The modulus of each element of a constraint kind: one value, or by the materials of its
//! vertices.

use cutis_mesh::Split;

use super::BodyParts;
use crate::Error;
use crate::scene::validate::Check;
use crate::scene::{Scene, SceneFile, TissueMaterialSection};

/// Modulus of the springs over Young's modulus of the body, if volume constraints are stiffer than
/// the springs (docs/book/theory.md). For `kuhn6` it holds along the axes of the lattice.
pub(super) fn springs_over_body(split: Split) -> f64 {
    match split {
        Split::Kuhn6 => 4.0,
        Split::Five => 5.0,
    }
}

/// The modulus of each element of a kind.
pub(super) enum Moduli<'a> {
    /// The same for all elements, Pa.
    Same(f64),
    /// By the rows of the table of materials.
    ByVertex {
        /// Modulus of each row, Pa.
        of_row: Vec<f64>,
        /// Number of the row of each vertex.
        row_of_vertex: &'a [u8],
    },
}

impl Moduli<'_> {
    /// The modulus of an element with these vertices: the harmonic mean of theirs, so that its
    /// compliance is the mean of the compliances that it would have in each of their materials.
    pub(super) fn of<const N: usize>(&self, element: [u32; N]) -> f64 {
        match self {
            Self::Same(modulus) => *modulus,
            Self::ByVertex { of_row, row_of_vertex } => {
                let rows = element.map(|vertex| row_of_vertex[vertex as usize]);
                if rows.iter().all(|row| *row == rows[0]) {
                    return of_row[usize::from(rows[0])];
                }
                let compliance: f64 = rows.iter().map(|row| 1.0 / of_row[usize::from(*row)]).sum();
                N as f64 / compliance
            }
        }
    }
}

/// Checks that a modulus comes from exactly one place: the key of its kind, or `materials`.
pub(super) fn validate(
    scene: &Scene,
    check: &Check<'_>,
    key: &str,
    modulus: Option<f64>,
) -> Result<(), Error> {
    if modulus.is_some() == scene.materials.is_some() {
        return Err(not_one_place(check.file, key, modulus));
    }
    modulus.map_or(Ok(()), |modulus| check.positive(key, modulus))
}

/// The error for a modulus that a scene gives in two places or nowhere.
fn not_one_place(file: SceneFile<'_>, key: &str, modulus: Option<f64>) -> Error {
    match modulus {
        Some(modulus) => {
            let why = "must be left out next to `materials`, whose rows give this modulus";
            file.bad_key(key, &format!("{modulus:?}"), why)
        }
        None => {
            file.bad_key(key, "", "is missing: give it, or give the moduli of all tissues by `materials`")
        }
    }
}

impl<'a> BodyParts<'a> {
    /// The moduli of a kind: `modulus`, the value of `key`, or `of_row` of the table of materials.
    ///
    /// # Errors
    /// [`Error::SceneKey`] if there are both or none.
    pub(super) fn moduli(
        &self,
        key: &str,
        modulus: Option<f64>,
        of_row: impl Fn(&TissueMaterialSection) -> f64,
    ) -> Result<Moduli<'a>, Error> {
        match (modulus, &self.body.materials) {
            (Some(modulus), None) => Ok(Moduli::Same(modulus)),
            (None, Some(materials)) => Ok(Moduli::ByVertex {
                of_row: materials.rows.iter().map(of_row).collect(),
                row_of_vertex: &materials.row_of_vertex,
            }),
            (modulus, _) => Err(not_one_place(self.file, key, modulus)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An element between two materials carries one stress, so the shares of its length or volume
    /// act like springs in series.
    #[test]
    fn an_element_between_materials_is_a_series_of_its_shares() {
        let moduli = Moduli::ByVertex { of_row: vec![1e3, 4e3, 1e6], row_of_vertex: &[0, 0, 1, 2] };
        assert_eq!(moduli.of([0, 1]), 1e3);
        assert_eq!(moduli.of([2, 2, 2, 2]), 4e3);
        assert_eq!(moduli.of([0, 2]), 1.6e3);
        // A quarter of the volume is almost rigid.
        let three_quarters = moduli.of([0, 1, 0, 3]);
        assert!((three_quarters / (1e3 * 4.0 / 3.001) - 1.0).abs() < 1e-12, "{three_quarters}");
        // Control: the arithmetic mean would be far stiffer.
        assert!(three_quarters < 0.01 * (3.0 * 1e3 + 1e6) / 4.0);
        assert_eq!(Moduli::Same(7.0).of([0, 3]), 7.0);
    }
}
