//! What the script of a page reads: the surface, its states, and the values over time.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde::Serialize;

use super::plots::Quantity;
use super::text;
use crate::body::Body;
use crate::output::surface::{self, Encoded, Recorder};
use crate::output::wound_place::WoundPlace;
use crate::run::frames::FrameRow;

/// Data of the script.
#[derive(Serialize)]
pub(super) struct Data {
    surface: Encoded,
    /// The states of the surface in the order of time.
    states: Vec<StateData>,
    /// The wound, for the first view; none without one.
    wound: Option<Place>,
    quantities: Vec<QuantityData>,
    rows: Rows,
}

#[derive(Serialize)]
struct StateData {
    name: String,
    frame: u32,
    time_s: f64,
    /// Values of the quantities.
    values: Vec<f64>,
}

/// A close-up.
#[derive(Serialize)]
struct Place {
    middle_mm: [f64; 3],
    size_mm: f64,
    /// Direction to the viewer.
    outward: [f64; 3],
}

#[derive(Serialize)]
struct QuantityData {
    name: String,
    title: &'static str,
    unit: &'static str,
}

/// Values over time.
#[derive(Serialize)]
struct Rows {
    time_s: Vec<f64>,
    /// One array for each quantity.
    values: Vec<Vec<f64>>,
}

impl Data {
    pub(super) fn of(body: &Body, recorder: &Recorder, quantities: &[Quantity], rows: &[&FrameRow]) -> Self {
        let state = |state: &surface::State| StateData {
            name: state.name.clone(),
            frame: state.row.frame,
            time_s: state.row.time_s,
            values: quantities.iter().map(|quantity| quantity.value(&state.row)).collect(),
        };
        let place = WoundPlace::of(body).map(|place| Place {
            middle_mm: place.close_up.center_mm,
            size_mm: place.close_up.size_mm,
            outward: place.outward,
        });
        let values = |quantity: &Quantity| rows.iter().map(|row| quantity.value(row)).collect();
        let about = |quantity: &Quantity| QuantityData {
            name: quantity.name.clone(),
            title: quantity.title(),
            unit: quantity.unit(),
        };
        Self {
            surface: surface::encode(recorder, body.mesh.frame.origin_mm),
            states: recorder.states.iter().map(state).collect(),
            wound: place,
            quantities: quantities.iter().map(about).collect(),
            rows: Rows {
                time_s: rows.iter().map(|row| row.time_s).collect(),
                values: quantities.iter().map(values).collect(),
            },
        }
    }

    /// The script elements that hold the data.
    pub(super) fn elements(&self) -> String {
        format!(
            "{}<script type=\"text/plain\" id=\"surface\">{}</script>\n",
            self.elements_without_surface(),
            STANDARD.encode(&self.surface.bytes)
        )
    }

    /// The script element that holds all but the bytes of the surface.
    pub(super) fn elements_without_surface(&self) -> String {
        format!("<script type=\"application/json\" id=\"data\">{}</script>\n", text::json(self))
    }
}
