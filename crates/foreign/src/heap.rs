//! The memory that an image gets from `malloc`: a separate range of addresses, which is restored together with the
//! image's variables.
//!
//! Its administrative data are at its beginning, so a copy of the used part keeps the whole heap. Blocks come from
//! lists of free blocks of about the same size, or from the end of the used part. Free blocks are never merged, because
//! the next trial starts with the initial heap.
#![allow(unsafe_code, reason = "memory is asked from the system, divided and copied")]

use std::ffi::c_void;
use std::io;
use std::ptr::{self, NonNull};

use crate::runtime::State;

/// Bytes of an image's heap. They are addresses only, until they are written to.
pub const ROOM: usize = 256 << 20;

/// Bytes behind it that are nobody's, so that a block at its end has an end.
const BEYOND: usize = 64 << 10;

/// Size in bytes of the administrative data at the beginning.
const STATE: usize = size_of::<State>().next_multiple_of(UNIT);

/// Memory that is given back to the system rather than cleared.
const MUCH: usize = 256 << 10;

/// Free blocks by their size in units of 16 bytes: each one up to 64, then four to each power of two.
const CLASSES: usize = 136;
const UNIT: usize = 16;
const FINE: usize = 64;

/// Header before each block.
#[repr(C, align(16))]
struct Head {
    /// Bytes from the block's begin on.
    room: usize,
    class: u16,
    /// Whether it is in use.
    mark: u16,
    /// Units from where its class has it, for one that begins at a rounder address.
    shift: u32,
}

const IN_USE: u16 = 0x5355;
const FREE: u16 = 0x5346;

/// A heap: the used part of its memory, and the free blocks by size class.
#[derive(Debug)]
#[repr(C)]
pub struct Heap {
    begin: usize,
    /// End of the used part.
    top: usize,
    /// Whether anything was asked of it since it was kept.
    is_used: bool,
    free: [usize; CLASSES],
}

/// Returns the class of so many units and the units that all of its blocks have.
fn class_of(units: usize) -> (usize, usize) {
    if units <= FINE {
        return (units - 1, units);
    }
    let power = (usize::BITS - (units - 1).leading_zeros()) as usize;
    let (half, quarter) = (1 << (power - 1), 1 << (power - 3));
    let step = (units - 1 - half) / quarter;
    (FINE + (power - 7) * 4 + step, half + (step + 1) * quarter)
}

impl Heap {
    /// Returns whether a block is of it.
    pub fn has(&self, block: *const c_void) -> bool {
        (block as usize).wrapping_sub(self.begin) < ROOM
    }

    /// Returns a block of this number of bytes at an address that is a multiple of `align`, a power of two; null if
    /// there is no room.
    pub fn ask(&mut self, bytes: usize, align: usize) -> *mut c_void {
        if align <= UNIT {
            return self.block(bytes) as *mut c_void;
        }
        let begin = self.block(bytes.saturating_add(align));
        if begin == 0 {
            return ptr::null_mut();
        }
        let round = begin.next_multiple_of(align);
        // SAFETY: both heads are of this block, whose memory is from here on in use.
        unsafe {
            let Head { room, class, .. } = *Self::head(begin);
            let shift = u32::try_from((round - begin) / UNIT).unwrap_or(0);
            *Self::head(round) = Head { room: room - (round - begin), class, mark: IN_USE, shift };
        }
        round as *mut c_void
    }

    fn block(&mut self, bytes: usize) -> usize {
        self.is_used = true;
        if bytes > ROOM {
            return 0;
        }
        let (class, units) = class_of(bytes.div_ceil(UNIT).max(1));
        let mut begin = self.free[class];
        if begin == 0 {
            begin = self.top + size_of::<Head>();
            let end = begin + units * UNIT;
            if end > self.begin + ROOM {
                return 0;
            }
            self.top = end;
        } else {
            // SAFETY: a free block of this heap, which begins with the next one of its class.
            self.free[class] = unsafe { *(begin as *const usize) };
        }
        let class = u16::try_from(class).unwrap_or(u16::MAX);
        // SAFETY: within the heap's memory, before its end as found above.
        unsafe { *Self::head(begin) = Head { room: units * UNIT, class, mark: IN_USE, shift: 0 } };
        begin
    }

    fn head(block: usize) -> *mut Head {
        (block - size_of::<Head>()) as *mut Head
    }

    /// Bytes that a block has.
    ///
    /// # Safety
    /// A block of this heap.
    pub unsafe fn room(block: *mut c_void) -> usize {
        // SAFETY: the caller's.
        unsafe { (*Self::head(block as usize)).room }
    }

    /// Frees a block. An invalid block, or one that was freed before, ends the program as in the C library.
    pub fn give(&mut self, block: *mut c_void) {
        let block = block as usize;
        // SAFETY: the head, and the begin of a block in use, are memory of this heap; a library that writes where it may not can
        // have made it anything, which the marks find out in most cases.
        unsafe {
            let head = Self::head(block);
            let begin = block.wrapping_sub((*head).shift as usize * UNIT);
            if !block.is_multiple_of(UNIT) || (*head).mark != IN_USE || usize::from((*head).class) >= CLASSES
            {
                libc::abort();
            }
            (*head).mark = FREE;
            (*Self::head(begin)).mark = FREE;
            let list = &mut self.free[usize::from((*head).class)];
            *(begin as *mut usize) = *list;
            *list = begin;
        }
    }
}

/// Memory of a heap, with the image's state beside its variables, and a copy for restoration.
#[derive(Debug)]
pub struct Space {
    state: NonNull<State>,
    kept: Vec<u8>,
}

impl Space {
    /// Reserves the memory of an image before the image is loaded.
    pub fn new() -> io::Result<Self> {
        // SAFETY: new memory wherever the system has room.
        let begin = unsafe {
            let all = libc::PROT_READ | libc::PROT_WRITE;
            let how = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS | libc::MAP_NORESERVE;
            let begin = libc::mmap(ptr::null_mut(), ROOM + BEYOND, all, how, -1, 0);
            if begin == libc::MAP_FAILED {
                return Err(io::Error::last_os_error());
            }
            libc::mprotect(begin.byte_add(ROOM), BEYOND, libc::PROT_NONE);
            begin
        };
        let state = begin.cast::<State>();
        let top = begin as usize + STATE;
        let heap = Heap { begin: begin as usize, top, is_used: false, free: [0; CLASSES] };
        // SAFETY: memory of that size, at a page's begin.
        unsafe { state.write(State::new(heap)) };
        Ok(Self { state: NonNull::new(state).ok_or_else(io::Error::last_os_error)?, kept: Vec::new() })
    }

    /// Returns the state at the begin of the heap's memory.
    pub fn state(&self) -> *mut State {
        self.state.as_ptr()
    }

    fn used(&self) -> usize {
        // SAFETY: written when it was made; nobody else is in it now.
        let heap = unsafe { &(*self.state.as_ptr()).heap };
        heap.top - heap.begin
    }

    /// Stores a copy of the present content.
    pub fn keep(&mut self) {
        let used = self.used();
        // SAFETY: nobody else is in it now.
        unsafe { (*self.state.as_ptr()).heap.is_used = used > STATE };
        // SAFETY: so many bytes are in use.
        self.kept = unsafe { std::slice::from_raw_parts(self.state.as_ptr().cast(), used) }.to_vec();
    }

    /// Restores the stored content; memory that was unused then is zeroed.
    pub fn set_back(&mut self) {
        let (begin, used, kept) = (self.state.as_ptr().cast::<u8>(), self.used(), self.kept.len());
        // SAFETY: memory of this heap, that was in use; nobody else is in it now.
        unsafe {
            if !(*self.state.as_ptr()).heap.is_used {
                let rest = size_of::<Heap>();
                ptr::copy_nonoverlapping(self.kept[rest..].as_ptr(), begin.add(rest), kept - rest);
                return;
            }
            if used > kept + MUCH {
                let whole = kept.next_multiple_of(64 << 10);
                libc::madvise(begin.add(whole).cast(), used - whole, libc::MADV_DONTNEED);
                begin.add(kept).write_bytes(0, whole - kept);
            } else if used > kept {
                begin.add(kept).write_bytes(0, used - kept);
            }
            ptr::copy_nonoverlapping(self.kept.as_ptr(), begin, kept);
        }
    }
}

impl Drop for Space {
    fn drop(&mut self) {
        // SAFETY: what `new` asked for, given back once, after the image whose it was is gone.
        unsafe { libc::munmap(self.state.as_ptr().cast(), ROOM + BEYOND) };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn law_a_class_has_room_for_all_that_is_put_into_it() {
        let mut last = (0, 0);
        for units in 1..100_000 {
            let (class, room) = class_of(units);
            assert!(
                room >= units && room <= units + units / 4 + 1 && class < CLASSES,
                "{units}: {class} {room}"
            );
            assert!(class == last.0 && room == last.1 || class == last.0 + 1 || units == 1, "{units}");
            last = (class, room);
        }
        assert!(class_of(ROOM / UNIT).0 < CLASSES);
    }

    #[test]
    fn law_a_heap_gives_blocks_that_do_not_overlap_and_is_set_back() {
        let mut space = Space::new().expect("room");
        // SAFETY: this test alone is in it.
        let heap = unsafe { &mut (*space.state()).heap };
        let kept = heap.ask(100, 16);
        // SAFETY: a block of so many bytes.
        unsafe { kept.cast::<u8>().write_bytes(7, 100) };
        space.keep();
        let run = |space: &mut Space| {
            // SAFETY: as above.
            let heap = unsafe { &mut (*space.state()).heap };
            let mut blocks: Vec<(usize, usize)> = Vec::new();
            for k in 0..2000_usize {
                let (bytes, align) = (k * k % 5000, 1 << (k % 9));
                let block = heap.ask(bytes, align);
                assert!(!block.is_null() && (block as usize).is_multiple_of(align) && heap.has(block));
                // SAFETY: a block of this heap.
                assert!(unsafe { Heap::room(block) } >= bytes);
                // SAFETY: as long as was asked for.
                unsafe { block.cast::<u8>().write_bytes(1, bytes) };
                blocks.push((block as usize, bytes));
                if k % 3 == 0 {
                    heap.give(blocks.swap_remove(k % blocks.len()).0 as *mut c_void);
                }
            }
            blocks.sort_unstable();
            assert!(blocks.windows(2).all(|two| two[0].0 + two[0].1 <= two[1].0));
            assert!(heap.ask(ROOM, 16).is_null() && heap.ask(usize::MAX, 16).is_null());
            blocks
        };
        let first = run(&mut space);
        // SAFETY: as above.
        unsafe { kept.cast::<u8>().write_bytes(9, 100) };
        space.set_back();
        // SAFETY: as above; the first block after those that were kept.
        unsafe {
            assert!((0..100).all(|k| *kept.cast::<u8>().add(k) == 7));
            let (begin, used) = (space.state().cast::<u8>(), space.used());
            assert!((used..used + 100_000).all(|k| *begin.add(k) == 0));
        }
        assert_eq!(run(&mut space), first);
    }
}
