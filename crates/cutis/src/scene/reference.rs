//! The scene reference of the book, written from the schema, so that the page always matches the
//! code.

use std::fmt::Write as _;

use serde_json::{Map, Value};

use super::load::schema;
use super::steps;

const HEAD: &str = "# Scene reference

`cutis scene reference` writes this page from the schema of the program; do not edit it by hand.

A scene is a TOML file. Lengths are millimeters. Positions are world millimeters in the volume's
RAS+ frame (x to the right, y to the front, z to the head). All other values are in SI units.
Moduli, lengths, factors and durations are above 0 unless their row says otherwise. Unknown keys
and values out of range are refused by name. `cutis scene new` prints a scene to start from.
";

/// Returns the reference as Markdown: one table per section, in the order of the schema.
pub fn reference() -> String {
    let page = Page { schema: schema() };
    let mut out = HEAD.to_owned();
    let all: Vec<_> = properties(&page.schema).into_iter().filter(|(name, _)| *name != "step").collect();
    let keys: Vec<_> = all.iter().copied().filter(|(_, property)| page.section(property).is_none()).collect();
    if !keys.is_empty() {
        out.push_str("\n## Before the first section\n");
        page.table(&mut out, &page.schema, &keys);
    }
    for (name, property) in all {
        page.write_section(&mut out, name, property, required(&page.schema, name));
    }
    out + &steps::reference()
}

struct Page {
    schema: Value,
}

/// A TOML table, or a list of tables.
struct Section<'a> {
    definition: &'a Value,
    list: bool,
}

impl Page {
    /// Writes a heading, the description of the section, its keys, then the sections inside it.
    fn write_section(&self, out: &mut String, path: &str, property: &Value, required: bool) {
        let Some(Section { definition, list }) = self.section_within(property) else { return };
        // The text of a property that is one choice of several describes all of them.
        let described = if self.section(property).is_some() { property } else { definition };
        let heading = if list { format!("[[{path}]]") } else { format!("[{path}]") };
        let level = 2 + path.matches('.').count();
        let _ = write!(out, "\n{} `{heading}`\n\n{}", "#".repeat(level), text(described, definition));
        out.push_str(if required { " Required.\n" } else { "\n" });
        let keys = properties(definition);
        self.table(out, definition, &keys);
        for (key, inner) in keys {
            self.write_section(out, &format!("{path}.{key}"), inner, false);
        }
    }

    /// Writes a table with one row per key.
    fn table(&self, out: &mut String, owner: &Value, keys: &[(&str, &Value)]) {
        out.push_str("\n| key | value | default | meaning |\n|---|---|---|---|\n");
        for &(key, property) in keys {
            let default = match property.get("default") {
                _ if required(owner, key) => "required".into(),
                Some(value) if !value.is_null() && self.section(property).is_none() => format!("`{value}`"),
                _ => "none".to_owned(),
            };
            let meaning = text(property, self.definition(property)).replace('\n', " ").replace('|', "\\|");
            let _ = writeln!(out, "| `{key}` | {} | {default} | {meaning} |", self.kind(property));
        }
    }

    /// The type of a value, for people.
    fn kind(&self, property: &Value) -> String {
        match self.section(property) {
            Some(Section { list: true, .. }) => return "list of sections, see below".into(),
            Some(Section { list: false, .. }) => return "section, see below".into(),
            None => {}
        }
        let definition = self.definition(property);
        if let Some(choices) = definition["oneOf"].as_array() {
            return either(choices.iter().filter_map(|c| Some(format!("`{}`", c.get("const")?))).collect());
        }
        if let Some(choices) = definition["anyOf"].as_array() {
            return either(choices.iter().map(|choice| self.kind(choice)).collect());
        }
        let names: Vec<&str> = match &definition["type"] {
            Value::Array(types) => types.iter().filter_map(Value::as_str).filter(|t| *t != "null").collect(),
            other => other.as_str().into_iter().collect(),
        };
        match names.as_slice() {
            ["array"] => {
                let item = self.kind(&definition["items"]);
                let (least, most) = (definition["minItems"].as_u64(), definition["maxItems"].as_u64());
                match least {
                    Some(n) if least == most => format!("[{}]", vec![item; n as usize].join(", ")),
                    _ => format!("list of {item}"),
                }
            }
            ["integer"] => "whole number".into(),
            names => either(names.iter().map(|&name| name.to_owned()).collect()),
        }
    }

    /// The section that a property refers to, if it refers to one.
    fn section<'a>(&'a self, property: &'a Value) -> Option<Section<'a>> {
        let whole = self.definition(property);
        let definition = whole.get("items").map_or(whole, |item| self.definition(item));
        definition["properties"]
            .is_object()
            .then_some(Section { definition, list: whole.get("items").is_some() })
    }

    /// The section that a property refers to, possibly as one of several choices.
    fn section_within<'a>(&'a self, property: &'a Value) -> Option<Section<'a>> {
        let choices = self.definition(property)["anyOf"].as_array();
        self.section(property)
            .or_else(|| choices.into_iter().flatten().find_map(|choice| self.section(choice)))
    }

    /// The definition that a property refers to by `$ref`, or by the `anyOf` of an optional value.
    fn definition<'a>(&'a self, property: &'a Value) -> &'a Value {
        if let Some(name) = property["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
            return &self.schema["$defs"][name];
        }
        match property["anyOf"].as_array().map(Vec::as_slice) {
            Some([one, other]) if other["type"] == "null" => self.definition(one),
            _ => property,
        }
    }
}

fn properties(definition: &Value) -> Vec<(&str, &Value)> {
    let keys = definition["properties"].as_object().map(Map::iter);
    keys.into_iter().flatten().map(|(key, property)| (key.as_str(), property)).collect()
}

fn required(owner: &Value, key: &str) -> bool {
    owner["required"].as_array().is_some_and(|keys| keys.iter().any(|k| k == key))
}

/// Joins choices as `a, b or c`.
fn either(mut choices: Vec<String>) -> String {
    match choices.pop() {
        Some(last) if choices.is_empty() => last,
        Some(last) => format!("{} or {last}", choices.join(", ")),
        None => "any value".into(),
    }
}

/// The description of a property, or else of its type.
fn text<'a>(property: &'a Value, definition: &'a Value) -> &'a str {
    property["description"].as_str().or(definition["description"].as_str()).unwrap_or_default()
}
