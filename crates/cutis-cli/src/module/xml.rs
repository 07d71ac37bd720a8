//! The description of the module in XML, as the execution model of 3D Slicer defines it.
//!
//! Names, help, defaults and values come from the flags themselves. This table adds how Slicer
//! shows them. Source: the page of the execution model in the documentation of 3D Slicer.

use std::fmt::Write as _;

use clap::{Arg, CommandFactory};

use super::args::ModuleArgs;

/// A flag in the description.
struct Parameter {
    id: &'static str,
    /// Name and attributes of its element.
    element: &'static str,
    attributes: &'static str,
    channel: Option<&'static str>,
    label: &'static str,
    /// Smallest and largest value and step, for a number.
    constraints: Option<[f64; 3]>,
}

const fn parameter(id: &'static str, element: &'static str, label: &'static str) -> Parameter {
    Parameter { id, element, attributes: "", channel: None, label, constraints: None }
}

const fn input(parameter: Parameter, attributes: &'static str) -> Parameter {
    Parameter { attributes, channel: Some("input"), ..parameter }
}

const fn output(parameter: Parameter, attributes: &'static str) -> Parameter {
    Parameter { attributes, channel: Some("output"), ..parameter }
}

const fn number(parameter: Parameter, constraints: [f64; 3]) -> Parameter {
    Parameter { constraints: Some(constraints), ..parameter }
}

/// Name, description and parameters of each group.
const GROUPS: [(&str, &str, &[Parameter]); 3] = [
    (
        "Input",
        "The CT and the incision",
        &[
            input(parameter("input_volume", "image", "CT"), ""),
            input(
                parameter("incision", "pointfile", "Incision"),
                r#" type="any" fileExtensions=".mrk.json" coordinateSystem="lps""#,
            ),
            number(parameter("depth", "double", "Depth, mm"), [1.0, 200.0, 1.0]),
            parameter("body_part", "string-enumeration", "Part of the body"),
        ],
    ),
    (
        "Output",
        "What to write",
        &[
            output(parameter("output_volume", "image", "Deformed CT"), r#" reference="inputVolume""#),
            output(
                parameter("output_transform", "transform", "Displacement"),
                r#" type="nonlinear" fileExtensions=".nrrd""#,
            ),
            output(parameter("output_model", "geometry", "Deformed skin"), r#" fileExtensions=".ply""#),
            output(parameter("run_folder", "directory", "Run folder"), ""),
        ],
    ),
    (
        "Advanced",
        "Resolution, device, and a scene with all other settings",
        &[
            number(parameter("spacing", "double", "Spacing, mm"), [0.5, 20.0, 0.5]),
            parameter("backend", "string-enumeration", "Device"),
            input(parameter("scene", "file", "Scene"), r#" fileExtensions=".toml""#),
        ],
    ),
];

/// The whole description.
pub(super) fn description() -> String {
    let command = ModuleArgs::command();
    let mut out = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n  <category>Surgery</category>\n  \
         <title>Cutis</title>\n  <description>Cuts the skin of a CT and shows how its tension opens the \
         wound. For research and teaching only.</description>\n  <version>{}</version>\n  \
         <documentation-url>{}</documentation-url>\n  <license>MIT or Apache-2.0</license>\n  \
         <contributor>The Cutis authors</contributor>\n",
        env!("CARGO_PKG_VERSION"),
        env!("CARGO_PKG_REPOSITORY"),
    );
    for (label, text, parameters) in GROUPS {
        let advanced = if label == "Advanced" { " advanced=\"true\"" } else { "" };
        let _ = write!(
            out,
            "  <parameters{advanced}>\n    <label>{label}</label>\n    <description>{text}</description>\n"
        );
        for parameter in parameters {
            if let Some(arg) = command.get_arguments().find(|arg| arg.get_id() == parameter.id) {
                add(&mut out, parameter, arg);
            }
        }
        if label == "Output" {
            out += OPENING;
        }
        out += "  </parameters>\n";
    }
    out + "</executable>\n"
}

/// The result that goes into the file of `--returnparameterfile`.
const OPENING: &str = "    <double>\n      <name>opening</name>\n      <label>Opening, mm</label>\n      \
    <description>Mean opening of the wound</description>\n      <channel>output</channel>\n      \
    <default>0</default>\n    </double>\n";

fn add(out: &mut String, parameter: &Parameter, arg: &Arg) {
    let Parameter { element, attributes, channel, label, constraints, .. } = parameter;
    let long = arg.get_long().unwrap_or_default();
    let mut lines = vec![("name", long.to_owned()), ("longflag", long.to_owned())];
    lines.push(("label", (*label).to_owned()));
    lines.push(("description", arg.get_help().map(ToString::to_string).unwrap_or_default()));
    lines.extend(channel.map(|channel| ("channel", channel.to_owned())));
    lines.extend(arg.get_default_values().first().map(|value| ("default", value.to_string_lossy().into())));
    let values = if *element == "string-enumeration" { arg.get_possible_values() } else { Vec::new() };
    lines.extend(values.iter().map(|value| ("element", value.get_name().to_owned())));
    let _ = writeln!(out, "    <{element}{attributes}>");
    for (name, value) in lines {
        let _ = writeln!(out, "      <{name}>{}</{name}>", escaped(&value));
    }
    if let Some([minimum, maximum, step]) = constraints {
        let _ = writeln!(
            out,
            "      <constraints>\n        <minimum>{minimum}</minimum>\n        <maximum>{maximum}</maximum>\n        \
             <step>{step}</step>\n      </constraints>"
        );
    }
    let _ = writeln!(out, "    </{element}>");
}

/// Text without the characters that have a meaning in XML.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use clap::Parser;

    use super::*;

    /// The values between some tags, in order.
    fn values<'a>(text: &'a str, tag: &str) -> Vec<&'a str> {
        let (open, close) = (format!("<{tag}>"), format!("</{tag}>"));
        text.split(&open).skip(1).filter_map(|rest| rest.split(&close).next()).collect()
    }

    #[test]
    fn the_description_lists_every_flag_once() {
        let text = description();
        let listed = values(&text, "longflag");
        let command = ModuleArgs::command();
        let shown = command.get_arguments().filter(|arg| !arg.is_hide_set());
        let mut flags: Vec<&str> = shown.filter_map(Arg::get_long).collect();
        let mut sorted = listed.clone();
        flags.sort_unstable();
        sorted.sort_unstable();
        assert_eq!(sorted, flags);
        assert!(listed.len() >= 10, "{listed:?}");
        let words = listed.iter().flat_map(|flag| {
            let value = match *flag {
                "depth" | "spacing" => "5",
                "bodyPart" => "limb",
                "backend" => "cpu",
                _ => "file",
            };
            [format!("--{flag}"), value.to_owned()]
        });
        let args = ModuleArgs::try_parse_from(["cutis".to_owned()].into_iter().chain(words)).unwrap();
        assert_eq!((args.depth, args.body_part.as_str()), (5.0, "limb"));
        assert!(ModuleArgs::try_parse_from(["cutis", "--inputVolume", "a", "--unheardOf", "b"]).is_err());
    }

    #[test]
    fn each_element_is_closed_and_escaped() {
        let text = description();
        for tag in
            ["executable", "parameters", "image", "double", "transform", "string-enumeration", "constraints"]
        {
            let open = text.matches(&format!("<{tag}>")).count() + text.matches(&format!("<{tag} ")).count();
            assert!(open > 0 && open == text.matches(&format!("</{tag}>")).count(), "{tag}");
        }
        assert_eq!(escaped("a<b>&\"c\""), "a&lt;b&gt;&amp;&quot;c&quot;");
        assert_eq!(values(&text, "element"), ["trunk", "limb", "head", "auto", "cpu", "gpu"]);
    }
}
