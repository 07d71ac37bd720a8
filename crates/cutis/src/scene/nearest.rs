//! The nearest one of some names, for messages about a misspelled one.

/// The name with the fewest edits from `wrong`. None if every name differs in most letters.
pub(crate) fn of<'a>(wrong: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let counted = names.map(|name| (distance(wrong, name), name));
    let (edits, name) = counted.min_by_key(|(edits, _)| *edits)?;
    let longer = wrong.chars().count().max(name.chars().count());
    (2 * edits <= longer).then_some(name)
}

/// The message of serde about an unknown key, with the nearest valid one before the list of all.
/// Other messages stay.
pub(crate) fn with_suggestion(message: &str) -> String {
    let mut words = message.split('`').skip(1).step_by(2);
    let wrong = words.next().filter(|_| message.starts_with("unknown field"));
    let near = wrong.and_then(|wrong| of(wrong, words));
    match (near, message.split_once(", expected ")) {
        (Some(near), Some((unknown, all))) => {
            format!("{unknown}; the nearest one is `{near}`; expected {all}")
        }
        _ => message.to_owned(),
    }
}

/// A message of serde in the words of people who do not know Rust.
pub(crate) fn plain(message: &str) -> String {
    const WORDS: [(&str, &str); 11] = [
        ("expected u32", "expected a whole number from 0 to 4294967295"),
        ("expected u64", "expected a whole number, 0 or more"),
        ("expected usize", "expected a whole number, 0 or more"),
        ("expected f32", "expected a number"),
        ("expected f64", "expected a number"),
        ("expected a boolean", "expected true or false"),
        ("expected a sequence", "expected a list"),
        ("expected a map", "expected a section"),
        ("unknown variant", "unknown name"),
        ("unknown field", "unknown key"),
        ("missing field", "missing key"),
    ];
    let plain = WORDS.iter().fold(message.to_owned(), |text, (rust, plain)| text.replace(rust, plain));
    // The names of structs mean nothing to a user.
    match plain.split_once("expected struct ") {
        Some((before, after)) => {
            let rest = after.trim_start_matches(|c: char| c.is_alphanumeric() || c == '_');
            format!("{before}expected a section{rest}")
        }
        None => plain,
    }
}

/// Number of letters to insert, remove or replace.
fn distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().take(100).collect(), b.chars().take(100).collect());
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.iter().enumerate() {
            let replaced = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(diagonal + 1).min(row[j] + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_levenshtein() {
        for (a, b, edits) in
            [("", "", 0), ("abc", "", 3), ("kitten", "sitting", 3), ("spacing", "spaicng", 2)]
        {
            assert_eq!((distance(a, b), distance(b, a)), (edits, edits), "{a} {b}");
        }
    }

    #[test]
    fn the_nearest_name_is_named_unless_all_are_far() {
        let names = ["spacing_mm", "vertices", "split"];
        assert_eq!(of("spcing_mm", names.into_iter()), Some("spacing_mm"));
        assert_eq!(of("frames", names.into_iter()), None);
        let message = "unknown field `spliit`, expected one of `spacing_mm`, `split`";
        let named =
            "unknown field `spliit`; the nearest one is `split`; expected one of `spacing_mm`, `split`";
        assert_eq!(with_suggestion(message), named);
        assert_eq!(with_suggestion("invalid type: `spliit`"), "invalid type: `spliit`");
    }

    #[test]
    fn messages_have_no_words_of_rust() {
        for (message, expected) in [
            ("invalid type: string \"x\", expected f64", "invalid type: string \"x\", expected a number"),
            ("expected struct OutputSection", "expected a section"),
            ("expected struct A with 3 elements", "expected a section with 3 elements"),
            ("missing field `volume`", "missing key `volume`"),
        ] {
            assert_eq!(plain(message), expected);
        }
    }
}
