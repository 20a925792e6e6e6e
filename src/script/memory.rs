//! What each thread has allocated, and a ceiling on it while the thread runs a script.
//!
//! Rhai measures strings, arrays and maps one by one and after they have been built; what they take
//! together, and what closures hold, it does not know. The system's limits are the whole process's:
//! they cannot tell a script's memory from a replay buffer's. So the allocator counts, one counter a
//! thread (a script's values never leave theirs), which costs about a nanosecond an allocation.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

thread_local! {
    /// Bytes that this thread has allocated less those it has freed. Negative where a thread frees
    /// what others have allocated.
    static TAKEN: Cell<isize> = const { Cell::new(0) };
    /// What [`TAKEN`] may come to. An allocation beyond it never returns.
    static CEILING: Cell<isize> = const { Cell::new(isize::MAX) };
    /// The number under which this thread is watched.
    static NUMBER: Cell<u64> = const { Cell::new(0) };
}

/// The number of the thread that stands still because it has hit its ceiling; 0 for none.
static EXHAUSTED: AtomicU64 = AtomicU64::new(0);

/// The system's allocator, counting. A program in which scripts run makes it its global allocator;
/// without it, nothing is counted and there is no ceiling.
#[derive(Debug, Clone, Copy, Default)]
pub struct CountingAllocator;

// SAFETY: every method hands its arguments on, unchanged, to `System`, and returns what that
// returns: its contract is `System`'s. What is done besides touches thread-locals that are
// initialised at compile time and have no destructor, so that it neither allocates, nor unwinds, nor
// fails while a thread starts or ends. A thread that hits its ceiling does not return, which
// an allocator may do (it is not undefined behaviour to be slow), and holds no lock of `System`.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        take(layout.size() as isize);
        // SAFETY: the caller keeps `alloc`'s contract, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        take(layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        take(size as isize - layout.size() as isize);
        // SAFETY: as above; `pointer` came from `System`, as every pointer of this allocator.
        unsafe { System.realloc(pointer, layout, size) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        TAKEN.set(TAKEN.get() - layout.size() as isize);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[inline]
fn take(size: isize) {
    let taken = TAKEN.get() + size;
    TAKEN.set(taken);
    if taken > CEILING.get() {
        stand_still();
    }
}

/// Whoever watches reports it and ends the process. Returning no memory instead would abort it,
/// with a message that tells the script's author nothing.
#[cold]
fn stand_still() -> ! {
    EXHAUSTED.store(NUMBER.get(), Ordering::Release);
    loop {
        std::thread::sleep(Duration::from_secs(1));
    }
}

/// What this thread has taken, in bytes.
#[inline]
pub(super) fn taken() -> isize {
    TAKEN.get()
}

/// How much this thread may still take; nothing is left only if there is a ceiling.
#[inline]
pub(super) fn left() -> isize {
    CEILING.get().saturating_sub(TAKEN.get())
}

/// Lets this thread take `bytes` more from now on, or as much as it likes.
#[inline]
pub(super) fn allow(bytes: Option<isize>) {
    CEILING.set(bytes.map_or(isize::MAX, |bytes| TAKEN.get().saturating_add(bytes)));
}

/// Gives this thread the number by which [`exhausted`] calls it.
pub(super) fn number_thread(number: u64) {
    NUMBER.set(number);
}

/// The number of a thread that has hit its ceiling and stands still.
pub(super) fn exhausted() -> Option<u64> {
    Some(EXHAUSTED.load(Ordering::Acquire)).filter(|n| *n != 0)
}
