//! SPDX license expressions: is one satisfied by a list of allowed licenses?

use anyhow::{Result, bail};

/// Whether `expression` can be satisfied with licenses of `allowed` only. `A WITH B` counts as one license of that
/// name; the old spelling `A/B` means `A OR B`.
///
/// # Errors
/// The expression is not well formed.
pub fn satisfied(expression: &str, allowed: &[String]) -> Result<bool> {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let words: Vec<&str> = spaced.split_whitespace().collect();
    let mut parser = Parser { words: &words, allowed };
    let result = parser.alternatives()?;
    if let Some(word) = parser.words.first() {
        bail!("unexpected `{word}` in license expression `{expression}`");
    }
    Ok(result)
}

struct Parser<'a> {
    words: &'a [&'a str],
    allowed: &'a [String],
}

impl<'a> Parser<'a> {
    fn next(&mut self) -> Option<&'a str> {
        let (first, rest) = self.words.split_first()?;
        self.words = rest;
        Some(first)
    }

    fn accept(&mut self, word: &str) -> bool {
        let found = self.words.first() == Some(&word);
        if found {
            self.next();
        }
        found
    }

    fn alternatives(&mut self) -> Result<bool> {
        let mut result = self.conjunction()?;
        while self.accept("OR") {
            result |= self.conjunction()?;
        }
        Ok(result)
    }

    fn conjunction(&mut self) -> Result<bool> {
        let mut result = self.license()?;
        while self.accept("AND") {
            result &= self.license()?;
        }
        Ok(result)
    }

    fn license(&mut self) -> Result<bool> {
        match self.next() {
            Some("(") => {
                let result = self.alternatives()?;
                if !self.accept(")") {
                    bail!("a bracket is not closed");
                }
                Ok(result)
            }
            Some(name) if !["OR", "AND", "WITH", ")"].contains(&name) => {
                let mut name = name.to_owned();
                if self.accept("WITH") {
                    let Some(exception) = self.next() else { bail!("WITH without an exception") };
                    name = format!("{name} WITH {exception}");
                }
                Ok(self.allowed.contains(&name))
            }
            other => bail!("a license is missing before {other:?}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(expression: &str) -> Result<bool> {
        satisfied(
            expression,
            &["MIT".to_owned(), "Zlib".to_owned(), "Apache-2.0 WITH LLVM-exception".to_owned()],
        )
    }

    #[test]
    fn alternatives_need_one_and_conjunctions_all() {
        for (expression, expected) in [
            ("MIT", true),
            ("GPL-3.0-only", false),
            ("MIT OR GPL-3.0-only", true),
            ("GPL-3.0-only/MIT", true),
            ("MIT AND GPL-3.0-only", false),
            ("MIT AND (GPL-3.0-only OR Zlib)", true),
            ("(MIT OR Zlib) AND GPL-3.0-only", false),
            ("Apache-2.0 WITH LLVM-exception", true),
            ("Apache-2.0", false),
        ] {
            assert_eq!(check(expression).unwrap(), expected, "{expression}");
        }
    }

    #[test]
    fn malformed_expressions_are_errors() {
        for expression in ["", "MIT OR", "(MIT", "MIT Zlib", "MIT WITH", ") MIT"] {
            assert!(check(expression).is_err(), "{expression}");
        }
    }
}
