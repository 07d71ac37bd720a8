//! Pictures as users see them: colors, letters and the scale bar, found by their pixels alone.

use std::collections::HashSet;
use std::ops::Range;

/// A decoded picture, 8-bit RGB.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pixels: Vec<[u8; 3]>,
}

/// Shapes of the characters that the tests look for: the width of their box over its height, and
/// how much ink each of 5 × 7 cells of the box has, from 0 to 9. They are from FreeType 2, which
/// drew the font of the pictures with 300 pixels per em.
const GLYPHS: [(char, f64, [&str; 7]); 20] = [
    ('R', 0.75, ["99971", "91066", "91056", "97682", "94570", "91082", "91047"]),
    ('L', 0.63, ["93000", "93000", "93000", "93000", "93000", "93000", "99999"]),
    ('A', 0.91, ["01910", "03830", "06460", "08080", "28682", "55355", "81018"]),
    ('P', 0.74, ["99982", "91048", "91029", "96585", "94420", "91000", "91000"]),
    ('S', 0.72, ["27982", "65038", "66101", "15972", "10058", "84038", "27883"]),
    ('I', 0.17, ["99999", "99999", "99999", "99999", "99999", "99999", "99999"]),
    ('0', 0.63, ["27872", "75057", "93039", "92029", "93039", "75057", "27872"]),
    ('1', 0.41, ["13578", "86499", "00099", "00099", "00099", "00099", "00099"]),
    ('2', 0.68, ["28871", "84066", "20065", "00381", "02820", "28200", "89888"]),
    ('5', 0.64, ["49997", "56000", "67651", "45377", "00039", "84058", "27882"]),
    ('m', 1.38, ["78585", "83938", "70707", "70707", "70707", "70707", "70707"]),
    ('b', 0.61, ["92000", "92000", "97883", "93048", "92039", "93058", "86882"]),
    ('e', 0.84, ["06971", "58266", "84139", "99999", "84000", "58346", "16983"]),
    ('f', 0.44, ["02788", "07910", "79974", "07900", "07900", "07900", "07900"]),
    ('o', 0.89, ["17971", "57276", "83038", "92029", "83038", "67276", "17971"]),
    ('r', 0.51, ["88589", "99854", "99100", "99100", "99100", "99100", "99100"]),
    ('a', 0.82, ["17971", "76276", "11267", "49787", "83057", "86287", "38867"]),
    ('t', 0.45, ["05930", "68975", "26952", "05930", "05930", "05941", "02798"]),
    ('4', 0.72, ["00391", "01891", "05491", "27091", "86595", "44495", "00091"]),
    ('8', 0.63, ["27882", "75057", "66166", "29892", "84048", "84048", "38883"]),
];

/// Difference of a shape from that of a character above which it is another one. Shapes of the same
/// character differ by 0.15 at the most, and those of two characters by 0.17 at least.
const OTHER: f64 = 0.16;

const WHITE: [u8; 3] = [255; 3];

impl Picture {
    /// Decodes a PNG file.
    pub fn of_bytes(bytes: &[u8]) -> Self {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut data).unwrap();
        assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
        let pixels = data[..info.buffer_size()].chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect();
        Self { width: info.width as usize, height: info.height as usize, pixels }
    }

    pub fn pixel(&self, x: usize, y: usize) -> [u8; 3] {
        self.pixels[y * self.width + x]
    }

    /// A part of the picture.
    pub fn part(&self, columns: Range<usize>, rows: Range<usize>) -> Self {
        let pixels = rows.clone().flat_map(|y| columns.clone().map(move |x| self.pixel(x, y))).collect();
        Self { width: columns.len(), height: rows.len(), pixels }
    }

    /// Pixels that a test accepts, as column and row.
    pub fn find(&self, accepts: impl Fn([u8; 3]) -> bool) -> Vec<[usize; 2]> {
        let all = (0..self.height).flat_map(|y| (0..self.width).map(move |x| [x, y]));
        all.filter(|&[x, y]| accepts(self.pixel(x, y))).collect()
    }

    /// Centers, in pixels, of all places where a text stands in white, in any size.
    pub fn texts(&self, text: &str) -> Vec<[f64; 2]> {
        let words: Vec<&str> = text.split(' ').collect();
        let letters: Vec<char> = words.concat().chars().collect();
        // The letters before which there is a space.
        let spaces: Vec<usize> = words
            .iter()
            .scan(0, |sum, word| Some(std::mem::replace(sum, *sum + word.len())))
            .skip(1)
            .collect();
        let marks = self.marks();
        let stands = |row: &&[&Mark]| {
            let fits = row.iter().zip(&letters).all(|(mark, letter)| mark.difference(*letter) < OTHER);
            let height = row.iter().map(|mark| mark.rows.len()).max().unwrap_or(0) as f64;
            let gap = |n: usize| row[n].columns.start as f64 - row[n - 1].columns.end as f64;
            let is_spaced = |n: usize| (0.3 * height..0.8 * height).contains(&gap(n)) == spaces.contains(&n);
            let in_line = |n: usize| {
                (0.0..0.8 * height).contains(&gap(n)) && row[n].rows.end.abs_diff(row[0].rows.end) < 3
            };
            fits && (1..row.len()).all(|n| in_line(n) && is_spaced(n))
        };
        let mut found = Vec::new();
        for first in &marks {
            // The marks on the same line, from left to right.
            let line: Vec<&Mark> =
                marks.iter().filter(|mark| mark.rows.end.abs_diff(first.rows.end) < 3).collect();
            for row in line.windows(letters.len()).filter(|row| std::ptr::eq(row[0], first)).filter(stands) {
                let last = row[row.len() - 1];
                let top = row.iter().map(|mark| mark.rows.start).min().unwrap_or(0);
                found.push([
                    (first.columns.start + last.columns.end) as f64 / 2.0,
                    (top + first.rows.end) as f64 / 2.0,
                ]);
            }
        }
        found
    }

    /// The white marks of the size of letters, from left to right.
    fn marks(&self) -> Vec<Mark> {
        let is_white = |x: usize, y: usize| self.ink(x, y) > 0.5;
        let mut seen = vec![false; self.width * self.height];
        let mut marks = Vec::new();
        for start in 0..seen.len() {
            let (x, y) = (start % self.width, start / self.width);
            if seen[start] || !is_white(x, y) {
                continue;
            }
            seen[start] = true;
            let (mut columns, mut rows, mut open) = (x..x + 1, y..y + 1, vec![(x, y)]);
            let mut near = HashSet::new();
            while let Some((x, y)) = open.pop() {
                columns = columns.start.min(x)..columns.end.max(x + 1);
                rows = rows.start.min(y)..rows.end.max(y + 1);
                for (x, y) in (y.saturating_sub(1)..(y + 2).min(self.height))
                    .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(self.width)).map(move |x| (x, y)))
                {
                    near.insert((x, y));
                    if !seen[y * self.width + x] && is_white(x, y) {
                        seen[y * self.width + x] = true;
                        open.push((x, y));
                    }
                }
            }
            if (6..80).contains(&rows.len()) && columns.len() < 100 {
                marks.push(Mark { cells: self.cells(&columns, &rows, &near), columns, rows });
            }
        }
        marks.sort_by_key(|mark| mark.columns.start);
        marks
    }

    /// Mean ink of the cells of a box, 5 × 7. Only the pixels `near` a mark count, because bright
    /// tissue may lie beyond the dark rim of a letter.
    fn cells(
        &self,
        columns: &Range<usize>,
        rows: &Range<usize>,
        near: &HashSet<(usize, usize)>,
    ) -> [[f64; 5]; 7] {
        let part = |of: &Range<usize>, n: usize, parts: usize| {
            let at = |n: usize| of.len() as f64 * n as f64 / parts as f64;
            let (from, to) = (at(n), at(n + 1));
            (from as usize..(to.ceil() as usize).min(of.len()))
                .map(move |pixel| {
                    let share = to.min(pixel as f64 + 1.0) - from.max(pixel as f64);
                    (pixel, share / (to - from))
                })
                .collect::<Vec<_>>()
        };
        std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                let mut sum = 0.0;
                for (y, high) in part(rows, row, 7) {
                    for (x, wide) in part(columns, column, 5) {
                        let at = (columns.start + x, rows.start + y);
                        sum += if near.contains(&at) { high * wide * self.ink(at.0, at.1) } else { 0.0 };
                    }
                }
                sum
            })
        })
    }

    /// How white a pixel is, 0 to 1. Bare skin has about a third.
    fn ink(&self, x: usize, y: usize) -> f64 {
        let darkest = self.pixel(x, y).into_iter().min().unwrap_or(0);
        ((f64::from(darkest) - 100.0) / 155.0).max(0.0)
    }

    /// The orientation letters at the left, right, top and bottom edge.
    pub fn letters(&self) -> [char; 4] {
        let (w, h) = (self.width, self.height);
        let middle = |length: usize| 2 * length / 5..3 * length / 5;
        let edges = [
            self.part(0..w / 10, middle(h)),
            self.part(w - w / 10..w, middle(h)),
            self.part(middle(w), 0..h / 10),
            self.part(middle(w), h - h / 10..h),
        ];
        edges.map(|edge| {
            // The nearest letter of each mark. A mark that is no letter is far from all.
            let nearest = |mark: &Mark| {
                let all = "RLAPSI".chars().map(|letter| (mark.difference(letter), letter));
                all.min_by(|a, b| a.0.total_cmp(&b.0)).filter(|(difference, _)| *difference < OTHER)
            };
            let there: Vec<(f64, char)> = edge.marks().iter().filter_map(nearest).collect();
            assert_eq!(there.len(), 1, "letters at one edge: {there:?}");
            there[0].1
        })
    }

    /// Pixels per millimeter by the scale bar: the longest white run at the bottom left over the
    /// length that its label names.
    pub fn scale_bar(&self) -> f64 {
        let corner = self.part(0..self.width / 3, self.height - self.height / 8..self.height);
        let label = [200, 100, 50, 20, 10, 5, 2, 1]
            .into_iter()
            .find(|mm| !corner.texts(&format!("{mm} mm")).is_empty());
        let run = |y: usize| {
            let row: Vec<bool> = (0..corner.width).map(|x| corner.pixel(x, y) == WHITE).collect();
            row.split(|white| !white).map(<[bool]>::len).max().unwrap_or(0)
        };
        let longest = (0..corner.height).map(run).max().unwrap();
        longest as f64 / f64::from(label.expect("the scale bar has a label"))
    }
}

/// A white mark of the size of a letter.
struct Mark {
    columns: Range<usize>,
    rows: Range<usize>,
    cells: [[f64; 5]; 7],
}

impl Mark {
    /// How much the shape differs from that of a character: the mean difference of the cells, and a
    /// part of the difference of the widths.
    fn difference(&self, character: char) -> f64 {
        let (_, width, rows) =
            GLYPHS.iter().find(|(known, ..)| *known == character).expect("a known character");
        let mut sum = 0.0;
        for (found, expected) in self.cells.iter().zip(rows) {
            for (found, expected) in found.iter().zip(expected.bytes()) {
                sum += (found - f64::from(expected - b'0') / 9.0).abs();
            }
        }
        let widths = self.columns.len() as f64 / self.rows.len() as f64 / width;
        sum / 35.0 + 0.3 * widths.ln().abs()
    }
}
