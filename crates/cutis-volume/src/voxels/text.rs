//! Text headers: lines of fields, and errors that name a field.

use std::path::Path;

use super::source::Source;
use crate::VolumeError;

/// Longest header, bytes. Longer ones hold other data, such as the tags of a DICOM file.
const LONGEST: usize = 1 << 20;

/// Most axes of a file. The format NRRD allows as many.
const MOST_AXES: usize = 16;

/// Reads lines without their end until `last` is true for one. The file may end before.
pub(crate) fn lines(
    source: &mut Source<'_>,
    last: impl Fn(&str) -> bool,
) -> Result<Vec<String>, VolumeError> {
    let (mut lines, mut line, mut size) = (Vec::new(), Vec::new(), 0);
    loop {
        let mut byte = [0];
        let end = source.fill(&mut byte)? == 0;
        size += 1;
        if size > LONGEST {
            let expected = "a text of at most 1 MB";
            return Err(header_error(&source.path, "header", "a longer one", expected));
        }
        if byte[0] != b'\n' && !end {
            line.push(byte[0]);
            continue;
        }
        let text = String::from_utf8_lossy(&line).trim_end_matches('\r').to_owned();
        line.clear();
        let done = end || last(&text);
        lines.push(text);
        if done {
            return Ok(lines);
        }
    }
}

/// The error for a field with an invalid value, or a missing one.
pub(crate) fn header_error(
    path: &Path,
    field: &'static str,
    value: &str,
    expected: &'static str,
) -> VolumeError {
    let value: String = value.chars().filter(|c| !c.is_control()).take(80).collect();
    VolumeError::Header { path: path.into(), field, value, expected }
}

/// Numbers with spaces between them. `None` if there are not `N`, or one is not finite.
pub(crate) fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text.split_whitespace().map(|part| part.parse().ok()).collect();
    numbers?.try_into().ok().filter(|numbers: &[f64; N]| numbers.iter().all(|number| number.is_finite()))
}

/// Sizes of axes with spaces between them: whole numbers above 0. `None` for more than
/// [`MOST_AXES`].
pub(crate) fn sizes(text: &str) -> Option<Vec<u64>> {
    let size = |part: &str| part.parse().ok().filter(|&size| size > 0);
    let sizes: Option<Vec<u64>> = text.split_whitespace().take(MOST_AXES + 1).map(size).collect();
    sizes.filter(|sizes| sizes.len() <= MOST_AXES)
}
