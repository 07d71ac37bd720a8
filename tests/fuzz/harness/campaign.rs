//! Runs changed inputs through a reader, and measures each call.

use std::collections::{BTreeSet, HashSet};
use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind, set_hook, take_hook};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Mutex, Once, PoisonError};
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use cutis_test_kit::Random;

use crate::memory;
use crate::mutate::mutate;
use crate::packed::unpacked_bytes;
use crate::targets::Target;

/// Time that every input may take, and per byte. The readers take about a thousandth of it.
const TIME: Duration = Duration::from_secs(2);
const TIME_PER_BYTE: Duration = Duration::from_micros(2);
/// After this time an input counts as one that never ends.
const HANG: Duration = Duration::from_secs(60);
/// Memory that every input may take, bytes: buffers, decoders, and the threads that start once.
const MEMORY: usize = 8 << 20;
/// Bytes of memory per byte that a compressed part unpacks to: voxels of one byte become two, and
/// the reserved memory grows ahead of them.
const MEMORY_PER_UNPACKED: usize = 12;
/// Most inputs that are kept for their new outcome.
const POOL: usize = 400;

/// How long a campaign runs.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Number of inputs.
    pub inputs: usize,
    /// Time after which no further input is tried.
    pub time: Duration,
    /// Seed of the generator.
    pub seed: u64,
}

/// The outcome of a campaign.
#[derive(Debug, Default)]
pub struct Campaign {
    /// Number of inputs that were tried.
    pub inputs: usize,
    /// Inputs that the reader accepted.
    pub accepted: usize,
    /// Number of different outcomes: acceptance and messages without their numbers.
    pub outcomes: usize,
    /// The slowest input.
    pub slowest: Duration,
    /// Largest share of the allowed memory that an input took.
    pub memory_share: f64,
    /// Places of panics in libraries that a reader turned into an error.
    pub caught: BTreeSet<String>,
    /// What must not happen.
    pub faults: Vec<Fault>,
}

/// An input that a reader does not bear.
#[derive(Clone, Debug)]
pub struct Fault {
    /// What happened.
    pub what: String,
    /// The input.
    pub input: Vec<u8>,
}

/// Only one campaign at a time can count the bytes of the process.
static ALONE: Mutex<()> = Mutex::new(());

/// Whether a reader runs, whose panics are not printed.
static READS: AtomicBool = AtomicBool::new(false);
/// The places of these panics.
static PANICS: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());

/// Keeps the places of the panics of readers. All others are printed as usual.
fn keep_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = take_hook();
        set_hook(Box::new(move |panic: &PanicHookInfo<'_>| {
            let Some(place) = panic.location().filter(|_| READS.load(Ordering::SeqCst)) else {
                return usual(panic);
            };
            PANICS.lock().unwrap_or_else(PoisonError::into_inner).insert(place.to_string());
        }));
    });
}

/// Tries changed inputs until a limit is reached, or after the third fault.
///
/// # Errors
/// The folder for the inputs cannot be written.
pub fn run(target: &Target, limits: &Limits) -> Result<Campaign> {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let desk = Desk::new(target)?;
    let mut random = Random::new(limits.seed);
    let mut pool = (target.seeds)();
    let mut seeds = pool.clone().into_iter();
    let mut campaign = Campaign::default();
    let mut outcomes = HashSet::new();
    let start = Instant::now();
    while campaign.inputs < limits.inputs && start.elapsed() < limits.time && campaign.faults.len() < 3 {
        let input = seeds.next().unwrap_or_else(|| mutate(&mut random, &pool, target.words));
        let tried = desk.try_input(target, &input)?;
        campaign.inputs += 1;
        campaign.slowest = campaign.slowest.max(tried.time);
        campaign.memory_share = campaign.memory_share.max(tried.memory_share);
        match tried.outcome {
            Err(what) => campaign.faults.push(Fault { what, input }),
            Ok(outcome) => {
                campaign.accepted += usize::from(outcome == ACCEPTED);
                if outcomes.insert(outcome) && pool.len() < POOL {
                    pool.push(input);
                }
            }
        }
    }
    campaign.outcomes = outcomes.len();
    campaign.caught = std::mem::take(&mut PANICS.lock().unwrap_or_else(PoisonError::into_inner));
    Ok(campaign)
}

/// Tries one input, and returns what is wrong with the outcome.
///
/// # Errors
/// The folder for the input cannot be written.
pub fn run_input(target: &Target, input: &[u8]) -> Result<Option<String>> {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(Desk::new(target)?.try_input(target, input)?.outcome.err())
}

/// The outcome of an input that is valid.
pub(crate) const ACCEPTED: &str = "accepted";

pub(crate) struct Tried {
    /// A short text for what the reader said, or what must not happen.
    pub(crate) outcome: Result<String, String>,
    time: Duration,
    memory_share: f64,
}

/// A folder for the file of the input, next to files that a hostile header may name.
pub(crate) struct Desk {
    folder: tempfile::TempDir,
    path: PathBuf,
    watched: Sender<()>,
}

impl Desk {
    pub(crate) fn new(target: &Target) -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("cutis-fuzz-").tempdir()?;
        let inputs = folder.path().join("inputs");
        std::fs::create_dir(&inputs)?;
        std::fs::write(folder.path().join("outside.raw"), [7; 4096])?;
        (target.prepare)(&inputs)?;
        let path = inputs.join(target.file);
        keep_panics();
        let (watched, signs) = channel();
        let (name, shown) = (target.name, path.clone());
        std::thread::spawn(move || watch(&signs, name, &shown));
        Ok(Self { folder, path, watched })
    }

    pub(crate) fn try_input(&self, target: &Target, input: &[u8]) -> Result<Tried> {
        // Some file systems write a file that is replaced to the disk at once.
        let _ = std::fs::remove_file(&self.path);
        std::fs::write(&self.path, input).with_context(|| format!("{}", self.folder.path().display()))?;
        READS.store(true, Ordering::SeqCst);
        let before = memory::start();
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| (target.read)(&self.path, input)));
        let (time, peak) = (start.elapsed(), memory::peak_above(before));
        READS.store(false, Ordering::SeqCst);
        // The watcher ends with the desk, so that this cannot fail.
        let _ = self.watched.send(());
        let allowed_time = TIME + TIME_PER_BYTE * input.len() as u32;
        let most =
            MEMORY + target.memory_per_byte * input.len() + MEMORY_PER_UNPACKED * unpacked_bytes(input);
        let outcome = match outcome {
            Err(panic) => Err(format!("panic: {} ({})", text_of(&*panic), panic_places())),
            Ok(Err(what)) => Err(what),
            Ok(Ok(_)) if time > allowed_time => {
                Err(format!("took {time:.1?} for {} bytes, more than {allowed_time:.1?}", input.len()))
            }
            Ok(Ok(_)) if peak > most => {
                Err(format!("allocated {peak} bytes for an input of {} bytes, more than {most}", input.len()))
            }
            Ok(Ok(said)) => Ok(without_numbers(&said)),
        };
        Ok(Tried { outcome, time, memory_share: peak as f64 / most as f64 })
    }
}

/// Ends the program if an input takes so long that it may never end.
fn watch(signs: &Receiver<()>, target: &str, path: &Path) {
    loop {
        match signs.recv_timeout(HANG) {
            Ok(()) => {}
            Err(RecvTimeoutError::Disconnected) => return,
            Err(RecvTimeoutError::Timeout) => {
                eprintln!("fault: {target} takes more than {HANG:?}: the input is {}", path.display());
                std::process::abort();
            }
        }
    }
}

fn text_of(panic: &dyn std::any::Any) -> String {
    let text = panic.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("without a message").into()
}

/// The places of the panics so far.
fn panic_places() -> String {
    let places = PANICS.lock().unwrap_or_else(PoisonError::into_inner);
    places.iter().cloned().collect::<Vec<_>>().join(", ")
}

/// A message without numbers and quoted parts, so that alike messages are equal.
fn without_numbers(text: &str) -> String {
    let unquoted = text.split(['"', '`']).step_by(2).collect::<String>();
    unquoted.chars().filter(|c| !c.is_ascii_digit()).take(160).collect()
}
