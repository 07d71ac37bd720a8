//! The battery for the constraint types of Cutis, with materials that use every parameter.

use cutis_conformance::{Subject, conformance};
use cutis_constraints::{
    Distance, DistanceMaterial, LipAdhesion, LipContact, LipContactMaterial, SkinStrip, SkinStripAtRest,
    SkinStripLaw, SkinStripMaterial, SkinStripTurn, SkinTension, SkinTensionMaterial, SkinTensionPaper,
    SkinTensionPaperMaterial, Thread, ThreadMaterial, Volume, VolumeMaterial,
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

conformance!(mod thread: Thread, 6, Subject::new([
    ThreadMaterial { ends: [[0.2, 0.3], [0.5, 0.4]], length_scale: 0.8 },
    ThreadMaterial { ends: [[0.0, 0.0], [1.0, 0.0]], length_scale: 0.1 },
    ThreadMaterial { ends: [[0.3, 0.3], [0.1, 0.6]], length_scale: 1.5 },
]));

conformance!(mod lip_contact: LipContact, 4, Subject::new(lips()).oriented());

conformance!(mod lip_adhesion: LipAdhesion, 4, Subject::new(lips()).oriented());

/// Points at the beginning of an edge, near its end and between them.
fn lips() -> Vec<LipContactMaterial> {
    vec![
        LipContactMaterial { part: 0.3, normal: [0.6, 0.0, 0.8] },
        LipContactMaterial { part: 0.0, normal: [0.0, -1.0, 0.0] },
        LipContactMaterial { part: 0.9, normal: [-0.48, 0.6, -0.64] },
    ]
}

/// Strips with low to high tension, with and without stiffening and resistance to compression.
fn strips() -> Vec<SkinStripMaterial> {
    let strip = |tension_n_per_m, stiffening, compression, direction| {
        let law = SkinStripLaw { tension_n_per_m, modulus_n_per_m: 50.0, stiffening, compression };
        SkinStripMaterial::new([0.3, -0.2, 1.0], direction, law).unwrap()
    };
    vec![
        strip(5.0, 0.0, 1.0, [1.0, 0.0, 0.0]),
        strip(20.0, 3.0, 0.25, [0.2, 1.0, 0.1]),
        strip(45.0, 10.0, 0.0, [1.0, -1.0, 0.4]),
    ]
}

conformance!(mod skin_strip: SkinStrip, 3, Subject::new(strips()).oriented());

conformance!(mod skin_strip_at_rest: SkinStripAtRest, 3, Subject::new(strips()).oriented());

conformance!(mod skin_strip_turn: SkinStripTurn, 3, Subject::new(strips()).oriented());
