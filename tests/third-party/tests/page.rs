//! The code blocks of the page `docs/book/adding-a-constraint.md` equal the tested code.

const PAGE: &str = include_str!("../../../docs/book/adding-a-constraint.md");
const RUST: &str = include_str!("../src/fiber_stretch.rs");
const WGSL: &str = include_str!("../src/fiber_stretch.wgsl");

/// The code blocks of the page in a language.
fn blocks(language: &str) -> Vec<&'static str> {
    let open = format!("\n```{language}\n");
    PAGE.split(open.as_str()).skip(1).filter_map(|rest| rest.split("```").next()).collect()
}

/// The lines of code, without comments and lines that are hidden on the page.
fn code(text: &str) -> Vec<&str> {
    let shown = |line: &&str| !line.is_empty() && !line.starts_with("//") && !line.starts_with("# ");
    text.lines().map(str::trim).filter(shown).collect()
}

#[test]
fn the_shader_on_the_page_is_the_tested_one() {
    assert_eq!(blocks("wgsl"), [WGSL]);
}

#[test]
fn the_type_and_the_line_on_the_page_are_the_tested_ones() {
    let [in_rust, line, _] = blocks("rust")[..] else { panic!("{} blocks", blocks("rust").len()) };
    // The page refers to the shader by a path relative to the page.
    let in_rust = in_rust.replace("../../tests/third-party/src/", "");
    let shown: Vec<&str> = [&in_rust, line].into_iter().flat_map(code).collect();
    assert_eq!(shown, code(RUST));
}
