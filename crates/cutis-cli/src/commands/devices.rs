//! `devices`: a table of the GPUs of this machine.

use cutis::{Device, Devices};

const HEAD: [&str; 7] = ["", "name", "kind", "driver", "buffer", "binding", "usable"];

pub(super) fn table(found: &Devices) -> String {
    let mut rows: Vec<[String; 7]> = Vec::new();
    if !found.devices.is_empty() {
        rows.push(HEAD.map(String::from));
    }
    rows.extend(found.devices.iter().map(|device| row(device, found.auto)));
    let widths: [usize; 7] =
        std::array::from_fn(|n| rows.iter().map(|row| row[n].chars().count()).max().unwrap_or(0));
    let line = |row: &[String; 7]| {
        let cells: Vec<String> =
            row.iter().zip(widths).map(|(cell, width)| format!("{cell:width$}")).collect();
        cells.join("  ").trim_end().to_owned()
    };
    let lines: Vec<String> = rows.iter().map(line).chain([found.note.clone()]).collect();
    lines.join("\n")
}

fn row(device: &Device, auto: Option<usize>) -> [String; 7] {
    let mib = |bytes: u64| format!("{} MiB", bytes >> 20);
    let taken = if auto == Some(device.index) { ", auto" } else { "" };
    [
        device.index.to_string(),
        device.name.clone(),
        device.kind.clone(),
        format!("{}, {}", device.api, device.driver),
        mib(device.limits.max_buffer_bytes),
        mib(device.limits.max_binding_bytes),
        match &device.why {
            None => format!("yes{taken}"),
            Some(why) => format!("no: {why}"),
        },
    ]
}
