//! `completions` and `man`: the command line described for shells, for `man` and for the book.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use clap::{Command, CommandFactory};
use clap_complete::Shell;
use cutis::Error;
use cutis::volume::PartialFile;

use crate::args::Args;
use crate::terminal::print;

/// Prints the completions of a shell.
pub(super) fn completions(shell: Shell) {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Args::command(), "cutis", &mut script);
    print(String::from_utf8_lossy(&script).trim_end());
}

/// Writes one man page for the program and one for each command.
pub(super) fn man(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|e| Error::File {
        path: folder.into(),
        action: "create the folder",
        why: e.to_string(),
    })?;
    let pages = pages(&Args::command());
    for (name, page) in &pages {
        let path = folder.join(format!("{name}.1"));
        let mut file = PartialFile::create(&path)?;
        let written = file.write_all(page);
        written.map_err(|e| Error::File { path, action: "write", why: e.to_string() })?;
        file.commit()?;
    }
    print(&format!(
        "{} pages in {}; `man -l {}` shows one",
        pages.len(),
        folder.display(),
        folder.join("cutis.1").display()
    ));
    Ok(())
}

/// Name and text of each man page.
fn pages(program: &Command) -> Vec<(String, Vec<u8>)> {
    all(program)
        .into_iter()
        .map(|(words, command)| {
            let mut page = Vec::new();
            // Writing to memory cannot fail.
            let _ = clap_mangen::Man::new(command).render(&mut page);
            (words.join("-"), page)
        })
        .collect()
}

/// The program and its commands, each with the words that call it.
fn all(program: &Command) -> Vec<(Vec<String>, Command)> {
    let mut program = program.clone().term_width(100);
    program.build();
    let mut found = Vec::new();
    collect(&program, &[], &mut found);
    found
}

fn collect(command: &Command, above: &[String], found: &mut Vec<(Vec<String>, Command)>) {
    let words = [above, &[command.get_name().to_owned()]].concat();
    found.push((words.clone(), command.clone()));
    for inner in command.get_subcommands().filter(|inner| inner.get_name() != "help" && !inner.is_hide_set())
    {
        collect(inner, &words, found);
    }
}

const HEAD: &str = "# Commands

`cutis man --markdown` writes this page from the program; do not edit it by hand. `cutis man FOLDER`
writes it as man pages. `cutis completions SHELL` prints completions; for bash:

```sh
cutis completions bash > ~/.local/share/bash-completion/completions/cutis
```
";

/// The help of all commands as a page of the book.
pub(super) fn markdown() -> String {
    let mut page = HEAD.to_owned();
    for (words, mut command) in all(&Args::command()) {
        let help = command.render_long_help().to_string();
        let help: Vec<&str> = help.trim_end().lines().map(str::trim_end).collect();
        let _ = write!(page, "\n## `{}`\n\n```text\n{}\n```\n", words.join(" "), help.join("\n"));
    }
    page
}
