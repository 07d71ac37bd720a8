//! Changes of valid inputs: bits, lengths, numbers in text, words of the format, cuts, copies and
//! joints of two inputs.

use cutis_test_kit::Random;

/// Largest input that is made, bytes.
const LARGEST: usize = 1 << 20;
/// One in so many inputs is made long by repeating a part of it.
const LONG: usize = 400;
/// Values of length and count fields that readers get wrong.
const NUMBERS: [u64; 14] = [
    0,
    1,
    2,
    0x7f,
    0x80,
    0xff,
    0x7fff,
    0x8000,
    0xffff,
    0x7fff_ffff,
    0x8000_0000,
    0xffff_ffff,
    0x7fff_ffff_ffff_ffff,
    u64::MAX,
];
/// The same for numbers in text.
const TEXTS: [&str; 18] = [
    "0",
    "-1",
    "1",
    "65535",
    "65536",
    "2147483647",
    "2147483648",
    "4294967296",
    "9223372036854775807",
    "18446744073709551615",
    "99999999999999999999999",
    "1e999",
    "-1e999",
    "nan",
    "inf",
    "1e-320",
    "0x10",
    "",
];

/// A changed copy of one of the inputs in the pool.
pub(crate) fn mutate(random: &mut Random, pool: &[Vec<u8>], words: &[&[u8]]) -> Vec<u8> {
    let mut input = pool[random.below(pool.len())].clone();
    for _ in 0..1 + random.below(4) {
        change(random, &mut input, pool, words);
    }
    if random.below(LONG) == 0 {
        lengthen(random, &mut input);
    }
    input.truncate(LARGEST);
    input
}

fn change(random: &mut Random, input: &mut Vec<u8>, pool: &[Vec<u8>], words: &[&[u8]]) {
    if input.is_empty() {
        input.extend(&pool[random.below(pool.len())]);
    }
    let at = random.below(input.len().max(1)).min(input.len());
    let other = random.below(input.len() + 1);
    let (from, to) = (at.min(other), at.max(other));
    match random.below(12) {
        0 => flip(input, at, 1 << random.below(8)),
        1 => put(input, at, &[random.bits() as u8]),
        2 | 3 => {
            let number = NUMBERS[random.below(NUMBERS.len())];
            let size = [1, 2, 4, 8][random.below(4)];
            let bytes = number.to_le_bytes();
            match random.below(2) {
                0 => put(input, at, &bytes[..size]),
                _ => put(input, at, &bytes[..size].iter().rev().copied().collect::<Vec<_>>()),
            }
        }
        4 | 5 => number_in_text(random, input, at),
        6 if !words.is_empty() => {
            let word = words[random.below(words.len())];
            input.splice(at..at, word.iter().copied());
        }
        7 if !words.is_empty() => put(input, at, words[random.below(words.len())]),
        8 => input.truncate(at),
        9 => drop(input.drain(from..to.min(from + 1 + random.below(64)))),
        10 => {
            let part = input[from..to.min(from + 1 + random.below(256))].to_vec();
            input.splice(to..to, part);
        }
        _ => {
            let second = &pool[random.below(pool.len())];
            let joint = random.below(second.len() + 1);
            input.truncate(at);
            input.extend(&second[joint..]);
        }
    }
}

/// Repeats a part of the input until it is long, so that work which grows with the square of the
/// length takes seconds.
fn lengthen(random: &mut Random, input: &mut Vec<u8>) {
    if input.is_empty() {
        return;
    }
    let at = random.below(input.len());
    let part = input[at..(at + 1 + random.below(24)).min(input.len())].to_vec();
    let copies = (LARGEST / 2).saturating_sub(input.len()) / part.len();
    input.splice(at..at, part.repeat(copies));
}

fn flip(input: &mut [u8], at: usize, bit: u8) {
    if let Some(byte) = input.get_mut(at) {
        *byte ^= bit;
    }
}

/// Overwrites bytes, as far as the input reaches.
fn put(input: &mut [u8], at: usize, bytes: &[u8]) {
    for (place, byte) in input.iter_mut().skip(at).zip(bytes) {
        *place = *byte;
    }
}

/// Replaces the next run of digits.
fn number_in_text(random: &mut Random, input: &mut Vec<u8>, at: usize) {
    let Some(start) = (at..input.len()).find(|&n| input[n].is_ascii_digit()) else { return };
    let end = (start..input.len()).find(|&n| !input[n].is_ascii_digit()).unwrap_or(input.len());
    let text = TEXTS[random.below(TEXTS.len())];
    input.splice(start..end, text.bytes());
}
