//! The list `[[step]]`: what is done to the body, in the order of time.
//!
//! A step is a section with a kind. Reading a scene moves each step to the list of its section, so
//! that no other code knows of steps. Errors still name the step.

use serde_json::json;
use toml::Value;

/// The kinds of steps, the lists of sections to which they belong, and the types of these.
const KINDS: [(&str, &str, &str); 5] = [
    ("incise", "incision", "IncisionSection"),
    ("undermine", "undermining", "UnderminingSection"),
    ("excise", "excision", "ExcisionSection"),
    ("suture", "suture", "SutureSection"),
    ("hook", "handle", "HandleSection"),
];

/// Where the steps of a scene went: for each step its list, and its number there.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct Steps(Vec<(&'static str, usize)>);

/// What is wrong with a step: key, value, and what would be right.
pub(super) type BadStep = (String, String, String);

impl Steps {
    /// Moves the steps of a scene to the lists of their sections.
    pub(super) fn take(scene: &mut Value) -> Result<Self, BadStep> {
        let Some(table) = scene.as_table_mut() else { return Ok(Self::default()) };
        let Some(steps) = table.remove("step") else { return Ok(Self::default()) };
        let Value::Array(steps) = steps else {
            let why = "must be a list: write [[step]]";
            return Err(("step".into(), steps.to_string(), why.into()));
        };
        let (mut origins, mut last) = (Vec::new(), 0.0);
        for (number, mut step) in steps.into_iter().enumerate() {
            let kinds: Vec<&str> = KINDS.iter().map(|(kind, ..)| *kind).collect();
            let kind = step.as_table_mut().and_then(|step| step.remove("kind"));
            let known = kind.as_ref().and_then(Value::as_str);
            let Some((_, list, _)) = KINDS.iter().find(|(kind, ..)| known == Some(kind)) else {
                let shown = kind.map(|kind| kind.to_string()).unwrap_or_default();
                let why = format!("must be one of {}", kinds.join(", "));
                return Err((format!("step[{number}].kind"), shown, why));
            };
            // Any wrong type is found when the section is read.
            let at_s = step.get("at_s").and_then(|at| at.as_float().or(at.as_integer().map(|n| n as f64)));
            let at_s = at_s.unwrap_or(0.0);
            if at_s < last {
                let why =
                    format!("must not be before the step above it, at {last} s: steps are in order of time");
                return Err((format!("step[{number}].at_s"), format!("{at_s}"), why));
            }
            last = at_s;
            let sections = table.entry(*list).or_insert_with(|| Value::Array(Vec::new()));
            let Value::Array(sections) = sections else {
                let why = format!("must be a list: write [[{list}]]");
                return Err(((*list).into(), sections.to_string(), why));
            };
            origins.push((*list, sections.len()));
            sections.push(step);
        }
        Ok(Self(origins))
    }

    /// The key as the scene names it: `incision[0].depth_mm` may be `step[2].depth_mm`.
    pub(crate) fn name(&self, key: &str) -> String {
        let renamed = self.0.iter().enumerate().find_map(|(step, (list, number))| {
            let rest = key.strip_prefix(&format!("{list}[{number}]"))?;
            Some(format!("step[{step}]{rest}"))
        });
        renamed.unwrap_or_else(|| key.to_owned())
    }
}

/// Adds the list of steps to the schema of a scene.
pub(super) fn add_to_schema(schema: &mut serde_json::Value) {
    let step = |(kind, _, section): &(&str, &str, &str)| {
        let mut step = schema["$defs"][section].clone();
        step["properties"]["kind"] = json!({ "const": kind });
        if let Some(required) = step["required"].as_array_mut() {
            required.push(json!("kind"));
        }
        step
    };
    let kinds: Vec<serde_json::Value> = KINDS.iter().map(step).collect();
    schema["properties"]["step"] = json!({
        "description": "What is done to the body, in the order of time, in place of the lists of sections.",
        "type": "array",
        "items": { "oneOf": kinds },
    });
}

/// The part of the scene reference about steps.
pub(super) fn reference() -> String {
    let mut out = "\n## `[[step]]`\n\n\
        What is done to the body, as one list in the order of time. A step has the keys of a section\n\
        and a `kind`. The section may also be written by itself.\n\n\
        | kind | section |\n|---|---|\n"
        .to_owned();
    for (kind, list, _) in KINDS {
        out += &format!("| {kind} | `[[{list}]]` |\n");
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(text: &str) -> (Value, Result<Steps, BadStep>) {
        let mut scene = toml::from_str::<toml::Table>(text).map(Value::Table).unwrap();
        let steps = Steps::take(&mut scene);
        (scene, steps)
    }

    #[test]
    fn steps_go_to_the_lists_of_their_sections() {
        let (scene, steps) = take(
            "incision = [{ depth_mm = 1 }]\n[[step]]\nkind = \"incise\"\ndepth_mm = 2\n\
             [[step]]\nkind = \"hook\"\nat_s = 1\n[[step]]\nkind = \"incise\"\nat_s = 1.5",
        );
        let steps = steps.unwrap();
        assert_eq!(scene["incision"].as_array().unwrap().len(), 3);
        assert_eq!(scene["handle"].as_array().unwrap().len(), 1);
        assert!(scene.get("step").is_none());
        for (key, name) in [
            ("incision[0].depth_mm", "incision[0].depth_mm"),
            ("incision[1].depth_mm", "step[0].depth_mm"),
            ("incision[2]", "step[2]"),
            ("handle[0].at_mm", "step[1].at_mm"),
            ("handle", "handle"),
        ] {
            assert_eq!(steps.name(key), name);
        }
    }

    #[test]
    fn bad_lists_of_steps_are_refused() {
        for (text, key) in [
            ("step = 1", "step"),
            ("step = [{ kind = \"cut\" }]", "step[0].kind"),
            ("step = [{}]", "step[0].kind"),
            ("step = [1]", "step[0].kind"),
            ("step = [{ kind = \"hook\", at_s = 2 }, { kind = \"incise\", at_s = 1.5 }]", "step[1].at_s"),
            ("incision = 1\nstep = [{ kind = \"incise\" }]", "incision"),
        ] {
            assert_eq!(take(text).1.unwrap_err().0, key, "{text}");
        }
    }
}
