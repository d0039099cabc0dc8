//! Loops that all threads of rayon's pool share, in the order of numbers wherever order matters.
//!
//! rayon's own iterators are generic over all that is done with them, and each use is compiled into copies of how work
//! is split and stolen: they were a fifth of the library's code. Here is one such loop, which calls a function behind a
//! reference once for each of few large parts.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock};

use rayon::prelude::*;

/// Numbers in a chunk, where little is to do for each.
pub(crate) const CHUNK: usize = 1 << 14;

/// Calls `each` with the numbers below `count`.
pub(crate) fn for_each(count: usize, each: &(dyn Fn(usize) + Sync)) {
    if count <= 1 {
        (0..count).for_each(each);
    } else {
        (0..count).into_par_iter().for_each(each);
    }
}

/// What a cell holds that outlives a render, made now if it is empty. Threads that find it empty at once each make it,
/// to the same bits, and one is kept: none waits for another, which a process that was forked meanwhile may not have.
#[inline]
pub(crate) fn kept<T>(cell: &OnceLock<T>, make: impl FnOnce() -> T) -> &T {
    if let Some(kept) = cell.get() {
        return kept;
    }
    // Somebody else may have been first
    drop(cell.set(make()));
    cell.get().expect("it was set")
}

/// What `make` makes of each number below `count`: few, and much to do for each.
pub(crate) fn collect<T: Send + Sync>(count: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let made: Vec<OnceLock<T>> = std::iter::repeat_with(OnceLock::new).take(count).collect();
    for_each(count, &|i| {
        let is_first = made[i].set(make(i)).is_ok();
        debug_assert!(is_first, "each number comes once");
    });
    made.into_iter().map(|one| one.into_inner().expect("each number comes")).collect()
}

/// Calls `each` with chunks of a list, `size` elements each but the last, and which of them it is.
pub(crate) fn for_each_chunk<T: Send>(list: &mut [T], size: usize, each: impl Fn(usize, &mut [T]) + Sync) {
    let chunks: Vec<Mutex<&mut [T]>> = list.chunks_mut(size).map(Mutex::new).collect();
    for_each(chunks.len(), &|i| each(i, &mut chunks[i].lock().expect("each chunk comes once")));
}

/// Calls `each` with the elements of a list, in chunks of `size`, and which of them it is.
pub(crate) fn for_each_mut<T: Send>(list: &mut [T], size: usize, each: impl Fn(usize, &mut T) + Sync) {
    for_each_chunk(list, size, |chunk, list| {
        list.iter_mut().zip(chunk * size..).for_each(|(value, i)| each(i, value));
    });
}

/// What `make` makes of each number below `count`, in chunks of `size`.
pub(crate) fn map<T: Clone + Default + Send>(count: usize, size: usize, make: impl Fn(usize) -> T + Sync) -> Vec<T> {
    let mut list = vec![T::default(); count];
    for_each_mut(&mut list, size, |i, value| *value = make(i));
    list
}

/// Whether something is so for all numbers below `count`, in chunks of `size`.
pub(crate) fn all(count: usize, size: usize, is: impl Fn(usize) -> bool + Sync) -> bool {
    let so_far = AtomicBool::new(true);
    for_each(count.div_ceil(size), &|chunk| {
        if so_far.load(Ordering::Relaxed) && !(chunk * size..((chunk + 1) * size).min(count)).all(&is) {
            so_far.store(false, Ordering::Relaxed);
        }
    });
    so_far.into_inner()
}

/// For how many numbers below `count` something is so, in chunks of `size`.
pub(crate) fn count(count: usize, size: usize, is: impl Fn(usize) -> bool + Sync) -> usize {
    let total = AtomicUsize::new(0);
    for_each(count.div_ceil(size), &|chunk| {
        let found = (chunk * size..((chunk + 1) * size).min(count)).filter(|i| is(*i)).count();
        total.fetch_add(found, Ordering::Relaxed);
    });
    total.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_is_what_was_first() {
        let cell = OnceLock::new();
        assert_eq!((kept(&cell, || 1), kept(&cell, || unreachable!("it is kept"))), (&1, &1));
        // Somebody else comes first while it is made
        let cell = OnceLock::new();
        let made = kept(&cell, || {
            assert_eq!(cell.set(2), Ok(()));
            3
        });
        assert_eq!(made, &2);
    }

    #[test]
    fn every_number_comes_once_and_in_its_place() {
        for n in [0, 1, 2, 7, 8, 9, 1000] {
            assert_eq!(collect(n, |i| i * i), (0..n).map(|i| i * i).collect::<Vec<_>>());
            assert_eq!(map(n, 8, |i| i + 1), (1..=n).collect::<Vec<_>>());
            assert_eq!(count(n, 8, |i| i % 3 == 0), n.div_ceil(3));
            assert!(all(n, 8, |i| i < n));
            assert_eq!(all(n, 8, |i| i + 1 < n), n == 0);
            let mut list = vec![0; n];
            for_each_chunk(&mut list, 8, |chunk, part| part.iter_mut().for_each(|value| *value += chunk + 1));
            assert!(list.iter().enumerate().all(|(i, value)| *value == i / 8 + 1));
        }
    }
}
