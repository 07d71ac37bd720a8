//! Rules about WGSL: a shader says what it does, and uses only operations with the same bits on a
//! CPU.

use super::Finding;
use super::rules::{is_called, no_leftovers, not_too_long, words};
use super::source::Source;

/// Every rule about shaders.
pub const ALL: &[fn(&Source) -> Vec<Finding>] =
    &[begins_with_title, no_leftovers, not_too_long, the_same_on_a_cpu];

/// The shaders of the project. Each has a twin in Rust that gives the same bits.
const FOLDER: &str = "shaders/wgsl/";

/// Functions whose last bits an implementation may choose, or that contract a product with a sum,
/// with their replacement if there is one.
const INEXACT: &[(&str, &str)] = &[
    ("normalize", "write `v * (1.0 / length(v))`"),
    ("mix", "write the sum of two products"),
    ("smoothstep", "write the polynomial"),
    ("fma", "write `a * b + c`"),
    ("determinant", "write it out with `dot` and `cross`"),
    ("distance", "write `length(a - b)`"),
    ("reflect", "write it out with `dot`"),
    ("refract", "write it out with `dot`"),
    ("faceForward", "write it out with `dot`"),
    ("pow", "multiply"),
    ("exp", ""),
    ("exp2", ""),
    ("log", ""),
    ("log2", ""),
    ("sin", ""),
    ("cos", ""),
    ("tan", ""),
    ("asin", ""),
    ("acos", ""),
    ("atan", ""),
    ("atan2", ""),
    ("sinh", ""),
    ("cosh", ""),
    ("tanh", ""),
    ("asinh", ""),
    ("acosh", ""),
    ("atanh", ""),
    ("degrees", "multiply"),
    ("radians", "multiply"),
];

/// Starts of the names of matrix types. The order of the sums in their products is not specified.
const MATRICES: [&str; 3] = ["mat2x", "mat3x", "mat4x"];

/// The first line of a shader says, after `// `, what it does.
fn begins_with_title(source: &Source) -> Vec<Finding> {
    let titled = |comment: &str| comment.strip_prefix("// ").is_some_and(|title| !title.trim().is_empty());
    match source.lines.first() {
        Some(line) if line.code.is_empty() && titled(&line.comment) => Vec::new(),
        _ => vec![Finding::failure(
            &source.path,
            1,
            "the first line of a shader is `// ` and says what it does",
        )],
    }
}

/// Finds operations whose result may differ between a GPU and the twin in Rust.
fn the_same_on_a_cpu(source: &Source) -> Vec<Finding> {
    if !source.path.starts_with(FOLDER) {
        return Vec::new();
    }
    let mut findings = Vec::new();
    for (index, line) in source.lines.iter().enumerate() {
        for (name, instead) in INEXACT.iter().filter(|(name, _)| is_called(&line.code, name)) {
            let instead = if instead.is_empty() { "compute it on the CPU" } else { instead };
            let message = format!("`{name}` may differ from the twin in Rust: {instead}");
            findings.push(Finding::failure(&source.path, index + 1, message));
        }
        if words(&line.code).any(|word| MATRICES.iter().any(|matrix| word.starts_with(matrix))) {
            let message = "products of matrices may differ from the twin in Rust: write them out with `dot`";
            findings.push(Finding::failure(&source.path, index + 1, message));
        }
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: [usize; 0] = [];
    const SHADER: &str = "shaders/wgsl/solver/project.wgsl";

    fn lines(rule: fn(&Source) -> Vec<Finding>, path: &str, text: &str) -> Vec<usize> {
        rule(&Source::parse(path, text)).iter().map(|finding| finding.line).collect()
    }

    #[test]
    fn a_missing_title_is_caught() {
        assert_eq!(lines(begins_with_title, SHADER, "// Projects a color.\n"), NONE);
        for text in ["", "//\n", "//  \n", "\n// Late.\n", "const a = 1; // Late.\n", "/* Block. */\n"] {
            assert_eq!(lines(begins_with_title, SHADER, text), [1], "{text:?}");
        }
    }

    #[test]
    fn each_inexact_function_is_caught_at_its_line() {
        for (name, _) in INEXACT {
            let text = format!("// Title.\nfn f() {{\n    let a = {name} (b);\n}}\n");
            assert_eq!(lines(the_same_on_a_cpu, SHADER, &text), [3], "{name}");
        }
        assert_eq!(lines(the_same_on_a_cpu, SHADER, "let a = mat3x3<f32>();\nfn f(m: mat4x4f) {}\n"), [1, 2]);
    }

    #[test]
    fn exact_functions_own_functions_and_comments_pass() {
        let text = "// normalize(v) would differ.\n/* mix(a,\nfma(b) */ let a = dot(b, c) / sqrt(length(d));\n\
                    let pow = a; let b = pow * (a); let c = my_mix(a) + mixed(b); let d = format2x;\n";
        assert_eq!(lines(the_same_on_a_cpu, SHADER, text), NONE);
    }

    #[test]
    fn shaders_of_tests_may_be_inexact() {
        assert_eq!(lines(the_same_on_a_cpu, "tests/wrong.wgsl", "let a = normalize(b);\n"), NONE);
    }

    #[test]
    fn leftovers_and_length_count_as_in_rust() {
        let text = format!("// Title.\n// TODO later\n{}", "\n".repeat(600));
        let source = Source::parse(SHADER, &text);
        assert_eq!(ALL.iter().flat_map(|rule| rule(&source)).count(), 2);
    }
}
