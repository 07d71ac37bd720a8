//! Text in a page.

/// The text with a capital first letter.
pub(super) fn capitalized(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Lines as items of a list.
pub(super) fn items(lines: &[String]) -> String {
    lines.iter().map(|line| format!("<li>{}</li>", escape(line))).collect()
}

/// Text in which no character has a meaning in HTML, also within double or single quotes.
pub(crate) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
        .replace('\'', "&#39;")
}

/// A value as JSON that may stand in a script element: no character in it begins or ends an element
/// or a comment.
///
/// Only strings of JSON hold these characters, and there the escapes mean the same.
pub(super) fn json(value: &impl serde::Serialize) -> String {
    let text = serde_json::to_string(value).unwrap_or_else(|_| "null".into());
    text.replace('<', "\\u003c").replace('>', "\\u003e").replace('&', "\\u0026")
}

#[cfg(test)]
mod tests {
    use super::*;

    const HOSTILE: &str = "</script><script>alert(1)</script><!--'\"&\u{2028}<b onclick='x'>\u{0}";

    #[test]
    fn hostile_text_has_no_meaning_in_html_and_survives() {
        let escaped = escape(HOSTILE);
        assert!(!escaped.contains(['<', '>', '"', '\'']), "{escaped}");
        let back = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&#39;", "'"), ("&amp;", "&")];
        assert_eq!(back.iter().fold(escaped, |text, (from, to)| text.replace(from, to)), HOSTILE);
    }

    #[test]
    fn hostile_text_stays_within_a_script_element_and_survives() {
        let text = json(&[HOSTILE]);
        assert!(!text.contains(['<', '>', '&']), "{text}");
        assert_eq!(serde_json::from_str::<Vec<String>>(&text).unwrap(), [HOSTILE]);
    }
}
