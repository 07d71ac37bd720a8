//! The figures of the book's ChainMail page match the present code of the crate.

use std::path::Path;

#[path = "../../examples/figures/draw/mod.rs"]
mod draw;

#[test]
fn the_figures_of_the_book_are_current() {
    let book = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/book");
    let Ok(page) = std::fs::read_to_string(book.join("chainmail.md")) else {
        eprintln!("skipped: no book at {}", book.display()); // The published crate has no book.
        return;
    };
    let figures = draw::all().unwrap();
    for (name, svg) in &figures {
        let found = std::fs::read_to_string(book.join("figures").join(name));
        let same = found.is_ok_and(|found| found == *svg);
        assert!(same, "{name} is out of date: cargo run -p cutis-chainmail --example figures");
        assert!(page.contains(&format!("](figures/{name})")), "{name} is not on the page");
    }
    assert_eq!(page.matches("](figures/").count(), figures.len());
}

/// The figures show violated links for the classic algorithm, and none for the wave.
#[test]
fn only_classic_panels_show_links_beyond_their_limits() {
    for (name, svg) in draw::all().unwrap() {
        let panels: Vec<&str> = svg.split("font-weight=\"bold\">").skip(1).collect();
        let captions = |what: &str| panels.iter().filter(|panel| panel.contains(what)).count();
        let compared = name == "chainmail-materials.svg" || name == "chainmail-cut.svg";
        assert_eq!(captions(">None of "), usize::from(compared), "{name}");
        assert_eq!(captions(" links beyond their limits, the worst by "), usize::from(compared), "{name}");
        // Thick red lines appear in one panel and in the legend.
        assert_eq!(svg.matches("stroke-width=\"3\"").count(), 2 * usize::from(compared), "{name}");
    }
}
