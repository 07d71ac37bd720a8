//! The scene reference of the book, written from the schema, so that the page cannot lag behind the code.

use std::fmt::Write as _;

use serde_json::Value;

use super::load::schema;

/// The reference as Markdown: one table per section, in the order of the schema.
pub fn reference() -> String {
    let schema = schema();
    let mut out = String::from(
        "# Scene reference\n\nWritten by `cutis scene reference` from the schema of the program; do not edit by hand.\n\
         Lengths are world millimetres in the volume's RAS+ frame, everything else is SI. Unknown keys are refused.\n",
    );
    let empty = serde_json::Map::new();
    let sections = schema["properties"].as_object().unwrap_or(&empty);
    for (name, section) in sections {
        let target = resolve(&schema, section);
        let list = section["type"] == "array";
        let heading = if list { format!("[[{name}]]") } else { format!("[{name}]") };
        if target["properties"].is_object() {
            let _ = write!(out, "\n## `{heading}`\n\n{}\n", text(section, target));
            table(&mut out, &schema, name, target);
        } else {
            let _ = write!(out, "\n## `{name}`\n\n{} {}\n", text(section, target), kind(&schema, section));
        }
    }
    out
}

/// The rows of one section, then the sections inside it.
fn table(out: &mut String, schema: &Value, path: &str, section: &Value) {
    let empty = serde_json::Map::new();
    let properties = section["properties"].as_object().unwrap_or(&empty);
    let required = section["required"].as_array().map(Vec::as_slice).unwrap_or_default();
    let inner = |p: &Value| resolve(schema, p)["properties"].is_object() && p["type"] != "array";
    out.push_str("\n| key | value | default | meaning |\n|---|---|---|---|\n");
    for (key, property) in properties {
        let target = resolve(schema, property);
        let default = match property.get("default") {
            _ if required.iter().any(|r| r == key) => "required".into(),
            _ if inner(property) => String::new(),
            Some(Value::Null) | None => String::new(),
            Some(value) => format!("`{value}`"),
        };
        let meaning = text(property, target).replace('\n', " ").replace('|', "\\|");
        let _ = writeln!(out, "| `{key}` | {} | {default} | {meaning} |", kind(schema, property));
    }
    for (key, property) in properties.iter().filter(|(_, p)| inner(p)) {
        let path = format!("{path}.{key}");
        let _ = write!(out, "\n### `[{path}]`\n\n{}\n", text(property, resolve(schema, property)));
        table(out, schema, &path, resolve(schema, property));
    }
}

/// What a value may be, in words.
fn kind(schema: &Value, property: &Value) -> String {
    let target = resolve(schema, property);
    if let Some(choices) = target["oneOf"].as_array() {
        let names: Vec<String> =
            choices.iter().filter_map(|c| Some(format!("`{}`", c.get("const")?))).collect();
        return names.join(", ");
    }
    if let Some(choices) = target["anyOf"].as_array() {
        let names: Vec<String> =
            choices.iter().filter(|c| c["type"] != "null").map(|c| kind(schema, c)).collect();
        return names.join(" or ");
    }
    let kind = match &target["type"] {
        Value::Array(types) => {
            types.iter().find(|t| *t != "null").and_then(Value::as_str).unwrap_or_default()
        }
        other => other.as_str().unwrap_or_default(),
    };
    match kind {
        "array" => {
            let item = kind_of_items(schema, target);
            match target["minItems"].as_u64() {
                Some(n) if target["maxItems"].as_u64() == Some(n) => format!("{n} × {item}"),
                _ => format!("list of {item}"),
            }
        }
        "object" if target["properties"].is_object() => {
            let keys =
                target["properties"].as_object().map(|p| p.keys().cloned().collect::<Vec<_>>().join(", "));
            format!("{{ {} }}", keys.unwrap_or_default())
        }
        "integer" => "whole number".into(),
        other => other.into(),
    }
}

fn kind_of_items(schema: &Value, target: &Value) -> String {
    target.get("items").map(|items| kind(schema, items)).unwrap_or_else(|| "value".into())
}

/// The definition that a property points to: through `$ref`, an optional's `anyOf`, or a list's items.
fn resolve<'a>(schema: &'a Value, property: &'a Value) -> &'a Value {
    if let Some(name) = property["$ref"].as_str().and_then(|r| r.strip_prefix("#/$defs/")) {
        return &schema["$defs"][name];
    }
    if let Some([one, other]) = property["anyOf"].as_array().map(Vec::as_slice)
        && other["type"] == "null"
    {
        return resolve(schema, one);
    }
    match property.get("items") {
        Some(items) if items.get("$ref").is_some() && property.get("minItems").is_none() => {
            resolve(schema, items)
        }
        _ => property,
    }
}

/// A property's own description, else that of its type.
fn text<'a>(property: &'a Value, target: &'a Value) -> &'a str {
    property["description"].as_str().or(target["description"].as_str()).unwrap_or_default()
}
