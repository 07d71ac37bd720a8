//! Names of cases. They are names of folders on every system, and stay the same while scene, scan
//! and settings of the case do.

use std::path::Path;

use crate::run::files::sha256_of;

/// Most letters of a name that a study gives.
const MAX_GIVEN: usize = 80;
/// Most letters of a value in a name. Of a longer value the name has the start and a hash.
const MAX_VALUE: usize = 24;
/// Most letters of a whole name.
const MAX_NAME: usize = 160;
/// Letters of a hash in a name.
const HASH: usize = 8;

/// Refuses a given name that is not the name of a folder on every system.
pub(super) fn check(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let starts = name.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_');
    if starts && name.len() <= MAX_GIVEN && name.chars().all(plain) && !name.ends_with('.') {
        return Ok(());
    }
    Err(format!(
        "must have 1 to {MAX_GIVEN} letters, digits, `_`, `-` and `.`, and begin with a letter, a digit or `_`"
    ))
}

/// The name of a volume without its ending, or of a folder.
pub(super) fn of_volume(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    let known = [".nii", ".nrrd", ".nhdr", ".mha", ".mhd", ".hdr", ".dcm"];
    known.iter().find_map(|ending| name.strip_suffix(ending)).unwrap_or(name).to_owned()
}

/// The name of a scene file without its ending, with plain letters only.
pub(super) fn of_scene(path: &Path) -> String {
    folded(&path.file_stem().unwrap_or_default().to_string_lossy(), MAX_GIVEN)
}

/// `key=value` with plain letters only.
pub(super) fn of_setting(key: &str, value: &str) -> String {
    format!("{}={}", folded(key, MAX_GIVEN), folded(&plain(value), MAX_VALUE))
}

/// The parts joined. A case without parts has the name of its scene.
pub(super) fn joined(parts: &[String], scene: &Path) -> String {
    let name = if parts.is_empty() { of_scene(scene) } else { parts.join("+") };
    if name.len() <= MAX_NAME {
        return name;
    }
    // All letters are ASCII.
    format!("{}-{}", &name[..MAX_NAME - HASH - 1], &sha256_of(name.as_bytes())[..HASH])
}

/// A value as it is shown: text without quotes, and a number without a needless `.0`.
pub(super) fn plain(value: &str) -> String {
    if let Ok(number) = value.replace('_', "").parse::<f64>()
        && number.is_finite()
        && number.abs() < 1e15
    {
        return format!("{number}");
    }
    let text = toml::from_str::<toml::Table>(&format!("value = {value}")).ok();
    let text = text.and_then(|table| Some(table.get("value")?.as_str()?.to_owned()));
    text.unwrap_or_else(|| value.to_owned())
}

/// Letters, digits, `.`, `_` and `-` of a text. A text that loses something gets a hash.
fn folded(text: &str, most: usize) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let words: Vec<&str> = text.split(|c| !is_plain(c)).filter(|word| !word.is_empty()).collect();
    let mut short = words.join("-");
    if short == text && short.len() <= most && !short.is_empty() {
        return short;
    }
    short.truncate(most);
    format!("{short}-{}", &sha256_of(text.as_bytes())[..HASH]).trim_start_matches(['-', '.']).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_short_and_differ_where_values_do() {
        let name = |value| of_setting("spacing_mm", value);
        assert_eq!(
            [name("8"), name("8.0"), name("-0.5")],
            ["spacing_mm=8", "spacing_mm=8", "spacing_mm=-0.5"]
        );
        assert_eq!(of_setting("backend", "\"cpu\""), "backend=cpu");
        let long = [name("[1.0, 2.0, 3.0]"), name("[1.0, 2.0, -3.0]"), name("\"a/b\""), name("\"a b\"")];
        for (n, name) in long.iter().enumerate() {
            assert!(name.chars().all(|c| c.is_ascii_alphanumeric() || "=._-".contains(c)), "{name}");
            assert!(name.len() < 50 && !long[..n].contains(name), "{name}");
        }
        let parts: Vec<String> = (0..40).map(|n| format!("key_{n}=value")).collect();
        let whole = joined(&parts, Path::new("a.toml"));
        assert_eq!(whole.len(), MAX_NAME);
        assert_ne!(whole, joined(&parts[..39], Path::new("a.toml")));
        assert_eq!(joined(&[], Path::new("x/my scene.toml")).split('-').next(), Some("my"));
    }

    #[test]
    fn given_names_are_checked() {
        for good in ["a", "P01", "_x", "a.b-c_d"] {
            assert_eq!(check(good), Ok(()), "{good}");
        }
        for bad in ["", ".", "..", "-a", "a/b", "a b", "ä", "a.", "a+b", "a=b", &"a".repeat(81)] {
            assert!(check(bad).is_err(), "{bad}");
        }
        assert_eq!(of_volume(Path::new("x/ct.nii.gz")), "ct");
        assert_eq!(of_volume(Path::new("series/p.1")), "p.1");
    }
}
