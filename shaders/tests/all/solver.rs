//! The passes of the solver, for each constraint.

use cutis_shaders::constraints::{
    DISTANCE, LIP_ADHESION, LIP_CONTACT, SKIN_STRIP, SKIN_STRIP_AT_REST, SKIN_STRIP_TURN, SKIN_TENSION,
    SKIN_TENSION_PAPER, THREAD, VOLUME,
};
use cutis_shaders::solver::{self, Loads, Multiplier, Rule, Stiffness};

use crate::{assert_baseline, size_of_struct, validated};

/// Name, arity, number of parameters, source.
const KINDS: [(&str, usize, u32, &str); 10] = [
    ("distance", 2, 1, DISTANCE),
    ("volume", 4, 1, VOLUME),
    ("stc", 3, 2, SKIN_TENSION),
    ("stc_paper", 3, 3, SKIN_TENSION_PAPER),
    ("skin_strip", 3, 9, SKIN_STRIP),
    ("skin_strip_at_rest", 3, 9, SKIN_STRIP_AT_REST),
    ("skin_strip_turn", 3, 9, SKIN_STRIP_TURN),
    ("thread", 6, 5, THREAD),
    ("lip_contact", 4, 4, LIP_CONTACT),
    ("lip_adhesion", 4, 4, LIP_ADHESION),
];

#[test]
fn every_variant_of_every_kind_is_valid() {
    for (name, arity, _, source) in KINDS {
        for rule in [Rule::Pbd, Rule::Xpbd] {
            for stiffness in [Stiffness::Uniform, Stiffness::Each] {
                for multiplier in [Multiplier::None, Multiplier::First, Multiplier::Next] {
                    let joined = solver::project(arity, source, rule, stiffness, multiplier);
                    let what = format!("{name} {rule:?} {stiffness:?} {multiplier:?}");
                    assert_baseline(&what, &joined, &[solver::PROJECT]);
                }
            }
        }
        assert_baseline(name, &solver::vertex_force(arity, source), &[solver::VERTEX_FORCE]);
        assert_baseline(name, &solver::residual(arity, source), &[solver::RESIDUAL]);
        assert_baseline(name, &solver::evaluate(arity, source), &[solver::EVALUATE]);
    }
    let passes = ["predict", "predict_next", "finish_and_predict", "finish", "check", "restore"];
    for loads in [Loads::None, Loads::Each] {
        assert_baseline("vertices", &solver::vertices(loads), &passes);
        assert_baseline("descend", &solver::descend(loads), &[solver::DESCEND]);
    }
    assert_baseline("kinematic", &solver::kinematic(), &[solver::KINEMATIC]);
    assert_baseline("gather", &solver::gather(), &[solver::GATHER]);
}

#[test]
fn parameters_have_no_padding() {
    for (name, arity, count, source) in KINDS {
        assert_eq!(size_of_struct(&solver::evaluate(arity, source), "Params"), 4 * count, "{name}");
    }
}

/// Control: an unknown field and a wrong arity are errors.
#[test]
fn an_unknown_field_and_a_wrong_arity_are_rejected() {
    let broken = DISTANCE.replace("p.rest_length", "p.length");
    assert!(validated(&solver::evaluate(2, &broken)).is_err());
    assert!(validated(&solver::evaluate(3, VOLUME)).is_err(), "the constraint reads four vertices");
}
