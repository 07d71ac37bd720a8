//! Errors of cuts, with the section of the scene that made each.

use cutis_mesh::MeshError;

use crate::Error;
use crate::scene::SceneFile;

/// Turns an error of a cut into one that names its section, with the number.
pub(super) fn cut_error(file: SceneFile<'_>) -> impl Fn(MeshError) -> Error {
    move |error| {
        let section = match &error {
            MeshError::IncisionSize { incision, .. }
            | MeshError::IncisionPath { incision, .. }
            | MeshError::IncisionOffSkin { incision, .. }
            | MeshError::IncisionThroughSkin { incision, .. }
            | MeshError::IncisionWithoutSkin { incision }
            | MeshError::IncisionThroughBody { incision, .. }
            | MeshError::IncisionOverGap { incision, .. }
            | MeshError::IncisionEmpty { incision, .. }
            | MeshError::IncisionWithoutLips { incision, .. } => format!("incision[{incision}]"),
            MeshError::Undermining { undermining, .. } => format!("undermining[{undermining}]"),
            MeshError::Excision { excision, .. } => format!("excision[{excision}]"),
            _ => "incision".to_owned(),
        };
        // The section has the number of the cut, with which these messages begin too.
        let text = match &error {
            MeshError::Undermining { why, .. } | MeshError::Excision { why, .. } => why.clone(),
            other => other.to_string(),
        };
        let number = format!("{}: ", section.replace('[', " ").replace(']', ""));
        match (text.strip_prefix(&number), &error) {
            (Some(why), _) => file.bad_key(&section, "", why),
            (None, MeshError::Undermining { .. } | MeshError::Excision { .. }) => {
                file.bad_key(&section, "", &text)
            }
            (None, _) => file.blame(&section)(error),
        }
    }
}
