//! Reads portions of a file on one thread while a second thread works on those before.

use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread;

use crate::VolumeError;

/// Portions that wait for the second thread. One more is being filled, and one worked on.
const WAITING: usize = 2;

/// Calls `fill` on this thread for one portion after another, until it returns `None`, and `take`
/// on a second thread for each filled portion, in order. `fill` receives a buffer that is empty or
/// has an earlier portion.
///
/// # Errors
/// The first error in the order of the portions. [`VolumeError::Io`] if there can be no second
/// thread: it names `path`.
pub(super) fn fill_and_take<T: Send>(
    path: &Path,
    mut fill: impl FnMut(&mut Vec<u8>) -> Result<Option<T>, VolumeError>,
    mut take: impl FnMut(&[u8], T) -> Result<(), VolumeError> + Send,
) -> Result<(), VolumeError> {
    let (filled, portions): (SyncSender<(Vec<u8>, T)>, Receiver<_>) = sync_channel(WAITING);
    let (used, empty): (Sender<Vec<u8>>, Receiver<_>) = channel();
    thread::scope(|scope| {
        let work = move || {
            for (portion, of) in portions {
                take(&portion, of)?;
                // The other thread may have ended.
                let _ = used.send(portion);
            }
            Ok(())
        };
        let failed = |source| VolumeError::Io { path: path.into(), action: "read", source };
        let worker = thread::Builder::new().spawn_scoped(scope, work).map_err(failed)?;
        let mut read = || {
            loop {
                let mut portion = empty.try_recv().unwrap_or_default();
                let Some(of) = fill(&mut portion)? else { return Ok(()) };
                // The second thread ends early if it fails.
                if filled.send((portion, of)).is_err() {
                    return Ok(());
                }
            }
        };
        let read = read();
        drop(filled);
        let taken = worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        taken.and(read)
    })
}

#[cfg(test)]
mod tests {
    use std::io;

    use super::*;

    fn failure(reason: &str) -> VolumeError {
        let source = io::Error::other(reason.to_owned());
        VolumeError::Io { path: "ct.nii".into(), action: "read", source }
    }

    /// Reads portions `0..count` with their own numbers as bytes. Two of them may fail.
    fn run(count: u8, fill_fails: Option<u8>, take_fails: Option<u8>) -> (Vec<u8>, Result<(), String>) {
        let (mut next, mut taken) = (0, Vec::new());
        let fill = |portion: &mut Vec<u8>| {
            if Some(next) == fill_fails {
                return Err(failure("fill"));
            }
            portion.clear();
            portion.push(next);
            next += 1;
            Ok((next <= count).then_some(next - 1))
        };
        let take = |portion: &[u8], number| {
            assert_eq!(portion, [number]);
            taken.push(number);
            if Some(number) == take_fails { Err(failure("take")) } else { Ok(()) }
        };
        let result = fill_and_take(Path::new("ct.nii"), fill, take);
        (taken, result.map_err(|error| std::error::Error::source(&error).unwrap().to_string()))
    }

    #[test]
    fn portions_arrive_in_order_and_the_first_error_counts() {
        assert_eq!(run(0, None, None), (vec![], Ok(())));
        assert_eq!(run(200, None, None), ((0..200).collect(), Ok(())));
        assert_eq!(run(200, Some(7), None), ((0..7).collect(), Err("fill".into())));
        assert_eq!(run(200, None, Some(7)), ((0..=7).collect(), Err("take".into())));
        assert_eq!(run(200, Some(8), Some(7)), ((0..=7).collect(), Err("take".into())));
    }

    #[test]
    #[should_panic(expected = "of the second thread")]
    fn a_panic_of_the_second_thread_is_passed_on() {
        let fill = |_: &mut Vec<u8>| Ok(Some(()));
        let _ = fill_and_take(Path::new("ct.nii"), fill, |_, ()| panic!("of the second thread"));
    }
}
