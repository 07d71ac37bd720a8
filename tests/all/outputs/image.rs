//! Pictures as users see them: colors, letters and the scale bar, found by their pixels alone.

use std::ops::Range;

/// A decoded picture, 8-bit RGB.
pub struct Picture {
    pub width: usize,
    pub height: usize,
    pixels: Vec<[u8; 3]>,
}

/// Shapes of the characters that the tests look for, 5 × 7 cells each.
const GLYPHS: [(char, [&str; 7]); 21] = [
    ('R', ["####.", "#...#", "#...#", "####.", "#.#..", "#..#.", "#...#"]),
    ('L', ["#....", "#....", "#....", "#....", "#....", "#....", "#####"]),
    ('A', [".###.", "#...#", "#...#", "#####", "#...#", "#...#", "#...#"]),
    ('P', ["####.", "#...#", "#...#", "####.", "#....", "#....", "#...."]),
    ('S', [".####", "#....", "#....", ".###.", "....#", "....#", "####."]),
    ('I', [".###.", "..#..", "..#..", "..#..", "..#..", "..#..", ".###."]),
    ('0', [".###.", "#...#", "#..##", "#.#.#", "##..#", "#...#", ".###."]),
    ('1', ["..#..", ".##..", "..#..", "..#..", "..#..", "..#..", ".###."]),
    ('2', [".###.", "#...#", "....#", "...#.", "..#..", ".#...", "#####"]),
    ('5', ["#####", "#....", "####.", "....#", "....#", "#...#", ".###."]),
    ('m', [".....", ".....", "##.#.", "#.#.#", "#.#.#", "#.#.#", "#...#"]),
    ('b', ["#....", "#....", "####.", "#...#", "#...#", "#...#", "####."]),
    ('e', [".....", ".....", ".###.", "#...#", "#####", "#....", ".###."]),
    ('f', ["..##.", ".#..#", ".#...", "###..", ".#...", ".#...", ".#..."]),
    ('o', [".....", ".....", ".###.", "#...#", "#...#", "#...#", ".###."]),
    ('r', [".....", ".....", "#.##.", "##..#", "#....", "#....", "#...."]),
    ('a', [".....", ".....", ".###.", "....#", ".####", "#...#", ".####"]),
    ('t', [".#...", ".#...", "###..", ".#...", ".#...", ".#..#", "..##."]),
    ('4', ["...#.", "..##.", ".#.#.", "#..#.", "#####", "...#.", "...#."]),
    ('8', [".###.", "#...#", "#...#", ".###.", "#...#", "#...#", ".###."]),
    (' ', [".....", ".....", ".....", ".....", ".....", ".....", "....."]),
];

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

    /// Centers, in pixels, of all places where a text stands in pure white, in any size.
    pub fn texts(&self, text: &str) -> Vec<[f64; 2]> {
        let cells: Vec<_> = text.chars().map(cells).collect();
        let mut found = Vec::new();
        for scale in 1..=4 {
            let (width, height) = ((6 * cells.len() - 1) * scale, 7 * scale);
            for y in 0..=self.height.saturating_sub(height) {
                for x in 0..=self.width.saturating_sub(width) {
                    let fits = |(n, cells): (usize, &[[bool; 5]; 7])| {
                        (0..35).all(|cell| {
                            let (row, column) = (cell / 5, cell % 5);
                            let (left, top) = (x + (6 * n + column) * scale, y + row * scale);
                            self.is_white(left, top, scale, cells[row][column])
                        })
                    };
                    if self.is_framed(x..x + width, y..y + height) && cells.iter().enumerate().all(fits) {
                        found.push([x as f64 + width as f64 / 2.0, y as f64 + height as f64 / 2.0]);
                    }
                }
            }
        }
        found
    }

    /// True if no pixel next to a box is pure white.
    fn is_framed(&self, columns: Range<usize>, rows: Range<usize>) -> bool {
        let [left, top] = [columns.start, rows.start].map(|start| start.saturating_sub(1));
        let (right, bottom) = (columns.end.min(self.width - 1), rows.end.min(self.height - 1));
        let all = (top..=bottom).flat_map(|y| (left..=right).map(move |x| (x, y)));
        let mut around = all.filter(|(x, y)| !(columns.contains(x) && rows.contains(y)));
        around.all(|(x, y)| self.pixel(x, y) != WHITE)
    }

    /// True if all pixels of a cell are pure white (with `white`), or if none of them is (without).
    fn is_white(&self, left: usize, top: usize, size: usize, white: bool) -> bool {
        (top..top + size).all(|y| (left..left + size).all(|x| (self.pixel(x, y) == WHITE) == white))
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
            let is_there = |letter: &char| !edge.texts(&letter.to_string()).is_empty();
            let there: Vec<char> = "RLAPSI".chars().filter(is_there).collect();
            assert_eq!(there.len(), 1, "letters at one edge: {there:?}");
            there[0]
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

fn cells(character: char) -> [[bool; 5]; 7] {
    let (_, rows) = GLYPHS.iter().find(|(known, _)| *known == character).expect("a known character");
    rows.map(|row| std::array::from_fn(|column| row.as_bytes()[column] == b'#'))
}
