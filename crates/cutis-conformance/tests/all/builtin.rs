//! The battery for the constraint types of Cutis, with materials that use every parameter.

use cutis_conformance::{Subject, conformance};
use cutis_constraints::{
    Distance, DistanceMaterial, SkinTension, SkinTensionMaterial, SkinTensionPaper, SkinTensionPaperMaterial,
    Volume, VolumeMaterial,
};

conformance!(mod distance: Distance, 2, Subject::new([
    DistanceMaterial::default(),
    DistanceMaterial { rest_scale: 0.8 },
]));

conformance!(mod volume: Volume, 4, Subject::new([
    VolumeMaterial::default(),
    VolumeMaterial { rest_scale: 1.2 },
]));

conformance!(mod skin_tension: SkinTension, 3, Subject::new([
    SkinTensionMaterial::default(),
    SkinTensionMaterial { rest_area_scale: 0.9, amplification: 2.0 },
    SkinTensionMaterial { rest_area_scale: 0.5, amplification: 100.0 },
]));

conformance!(mod skin_tension_paper: SkinTensionPaper, 3, Subject::new([
    SkinTensionPaperMaterial { rest_area_scale: 0.9, amplification: 2.0, max_amplification: 3.0 },
]).direction_only());
