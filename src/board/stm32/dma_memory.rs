//! Memory that a DMA stream reads or writes by itself.

use core::cell::UnsafeCell;

/// Items in static memory, read and written one by one and volatile: a stream may do the same at any time.
pub(crate) struct DmaMemory<T, const N: usize>(UnsafeCell<[T; N]>);

// SAFETY: each is touched by one driver alone, which exists once, as it owns the peripherals; what the streams do at the same time is
// met with volatile accesses.
unsafe impl<T, const N: usize> Sync for DmaMemory<T, N> {}

impl<T: Copy, const N: usize> DmaMemory<T, N> {
    /// Memory that holds these items.
    pub(crate) const fn new(items: [T; N]) -> Self {
        Self(UnsafeCell::new(items))
    }

    /// Its address, for a stream.
    pub(crate) fn address(&self) -> u32 {
        self.0.get() as u32
    }

    fn place(&self, index: usize) -> *mut T {
        debug_assert!(index < N);
        self.0.get().cast::<T>().wrapping_add(index)
    }

    /// The item at a place.
    #[inline(always)]
    pub(crate) fn read(&self, index: usize) -> T {
        // SAFETY: one of the items, which are static.
        unsafe { self.place(index).read_volatile() }
    }

    /// Writes items from a place on.
    #[inline(always)]
    pub(crate) fn write(&self, first: usize, items: impl IntoIterator<Item = T>) {
        for (index, item) in (first..).zip(items) {
            // SAFETY: one of the items, which are static.
            unsafe { self.place(index).write_volatile(item) };
        }
    }
}
