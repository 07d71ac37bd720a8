//! `cargo xtask book`: builds the book in `docs` as a site, and checks every link of the site.
//!
//! Pages link to files of the repository that are not part of the site. In a copy of the pages such
//! links point to the repository on the web.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use crate::tidy::{link_targets, resolve};
use crate::workspace::{Workspace, execute};

/// The version that builds the site. The command to install it names it.
const MDBOOK: &str = "0.5.4";
/// The list of chapters.
const SUMMARY: &str = "docs/SUMMARY.md";
/// Files of the repository on the web.
const REPOSITORY: &str = "https://github.com/cutis-sim/cutis/blob/main/";

/// Builds the site into `book` in the target folder.
///
/// # Errors
/// mdBook is missing or fails, or a link of the site leads to nothing.
pub fn run(workspace: &Workspace) -> Result<()> {
    let program = require(workspace)?;
    let target = workspace.target_dir()?;
    let (pages, site) = (target.join("book-pages"), target.join("book"));
    for folder in [&pages, &site] {
        if folder.exists() {
            fs::remove_dir_all(folder).with_context(|| folder.display().to_string())?;
        }
    }
    copy(&workspace.root.join("docs"), &pages, "docs")?;
    execute(workspace.command(program).arg("build").arg(&pages))?;
    let (count, dead) = check(&site)?;
    dead.iter().for_each(|line| println!("failure: {line}"));
    println!("{count} links; the site is {}", site.join("index.html").display());
    if !dead.is_empty() {
        bail!("{} links of the site lead to nothing", dead.len());
    }
    Ok(())
}

/// The program mdBook: that of the target folder, or else an installed one.
///
/// # Errors
/// There is none of the right version. The error says how to install it.
pub fn require(workspace: &Workspace) -> Result<PathBuf> {
    let own = workspace.target_dir()?.join("tools/bin/mdbook");
    for program in [own, "mdbook".into()] {
        let version = workspace.command(&program).arg("--version").output();
        if version
            .is_ok_and(|output| String::from_utf8_lossy(&output.stdout).trim() == format!("mdbook v{MDBOOK}"))
        {
            return Ok(program);
        }
    }
    bail!(
        "mdBook {MDBOOK} is missing; install it with `cargo install --locked --debug --root target/tools \
         --no-default-features --features search mdbook@{MDBOOK}`"
    )
}

/// Copies a folder. In pages, links that leave `docs` become links to the web.
fn copy(from: &Path, to: &Path, name: &str) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from).with_context(|| from.display().to_string())? {
        let path = entry?.path();
        let file = path.file_name().and_then(|name| name.to_str()).context("a name that is not Unicode")?;
        let (to, name) = (to.join(file), format!("{name}/{file}"));
        if path.is_dir() {
            copy(&path, &to, &name)?;
        } else if file.ends_with(".md") {
            fs::write(to, for_the_site(&name, &fs::read_to_string(&path)?))?;
        } else {
            fs::copy(&path, to)?;
        }
    }
    Ok(())
}

/// A page whose links to files outside `docs` point to the web. mdBook renames each `README.md` to
/// `index.md`.
fn for_the_site(page: &str, text: &str) -> String {
    let mut out = String::new();
    let mut in_code = false;
    for line in text.split_inclusive('\n') {
        in_code ^= line.trim_start().starts_with("```");
        let mut line = line.to_owned();
        for target in link_targets(&line).into_iter().filter(|_| !in_code && page != SUMMARY) {
            let (path, anchor) = target.split_at(target.find('#').unwrap_or(target.len()));
            if path.is_empty() || path.contains("://") {
                continue;
            }
            let new = match resolve(page, path) {
                Some(path) if !path.starts_with("docs/") => format!("{REPOSITORY}{path}{anchor}"),
                _ => match path.strip_suffix("README.md") {
                    Some(folder) => format!("{folder}index.md{anchor}"),
                    None => continue,
                },
            };
            line = line.replace(&format!("]({target})"), &format!("]({new})"));
        }
        out += &line;
    }
    out
}

/// The number of links of a site, and those that lead to nothing.
fn check(site: &Path) -> Result<(usize, Vec<String>)> {
    let mut pages = Vec::new();
    find_pages(site, &mut pages)?;
    if pages.is_empty() {
        bail!("{} has no pages", site.display());
    }
    let (mut count, mut dead) = (0, Vec::new());
    for page in &pages {
        let text = fs::read_to_string(page)?;
        let links = ["href", "src"].into_iter().flat_map(|name| values(&text, name));
        for link in links.filter(|link| !link.contains(':') && !link.starts_with("//")) {
            count += 1;
            let (path, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = match path.split('?').next().unwrap_or_default() {
                "" => page.clone(),
                path => page.parent().unwrap_or(site).join(path),
            };
            let target = if target.is_dir() { target.join("index.html") } else { target };
            let found = target.is_file() && (anchor.is_empty() || ids(&target)?.contains(anchor));
            if !found {
                dead.push(format!("{}: {link}", page.strip_prefix(site).unwrap_or(page).display()));
            }
        }
    }
    Ok((count, dead))
}

fn find_pages(folder: &Path, pages: &mut Vec<PathBuf>) -> Result<()> {
    for entry in fs::read_dir(folder).with_context(|| folder.display().to_string())? {
        let path = entry?.path();
        if path.is_dir() {
            find_pages(&path, pages)?;
        } else if path.extension().is_some_and(|end| end == "html") && !path.ends_with("404.html") {
            // The links of the page for a missing address start from the root of a server.
            pages.push(path);
        }
    }
    pages.sort();
    Ok(())
}

fn ids(page: &Path) -> Result<BTreeSet<String>> {
    Ok(values(&fs::read_to_string(page)?, "id").collect())
}

/// Values of an attribute in HTML.
fn values<'a>(html: &'a str, name: &str) -> impl Iterator<Item = String> + use<'a> {
    let start = format!(" {name}=\"");
    let found: Vec<&str> = html.split(&start).skip(1).filter_map(|rest| rest.split('"').next()).collect();
    found.into_iter().map(|value| value.replace("&amp;", "&").replace("&#x27;", "'"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_that_leave_the_site_point_to_the_web() {
        let page = "[a](theory.md#x) [e](../results/README.md#y) [b](../../tests/all/a.rs#L1) [c](https://x.org)\n```\n[d](../../a)\n```\n";
        let expected = format!(
            "[a](theory.md#x) [e](../results/index.md#y) [b]({REPOSITORY}tests/all/a.rs#L1) [c](https://x.org)\n```\n[d](../../a)\n```\n"
        );
        assert_eq!(for_the_site("docs/book/tension.md", page), expected);
    }

    #[test]
    fn dead_links_of_a_site_are_found() {
        let site = std::env::temp_dir().join(format!("cutis-book-{}", std::process::id()));
        fs::create_dir_all(site.join("a")).unwrap();
        let good = "<h1 id=\"top\"></h1><a href=\"a/b.html#c\"></a><a href=\"#top\"></a> <a href=\"https://x.org\"></a>";
        fs::write(site.join("index.html"), good).unwrap();
        fs::write(site.join("a/b.html"), "<p id=\"c\"></p><a href=\"../index.html\"></a>").unwrap();
        assert_eq!(check(&site).unwrap(), (3, vec![]));
        let bad = "<a href=\"a/b.html#d\"></a><img src=\"gone.png\"><a href=\"#gone\"></a>";
        fs::write(site.join("index.html"), bad).unwrap();
        assert_eq!(check(&site).unwrap().1.len(), 3);
        fs::remove_dir_all(&site).unwrap();
    }
}
