//! Dead time: values that come out a fixed number of steps after they went in.

/// Values on their way, one a step.
#[derive(Clone, Debug)]
pub(super) struct Delay {
    /// The oldest at `next`, the latest before it.
    values: Vec<f64>,
    next: usize,
}

impl Delay {
    /// A delay of `steps` with zeros on their way.
    pub(super) fn of(steps: usize) -> Self {
        Self {
            values: vec![0.0; steps],
            next: 0,
        }
    }

    /// Puts a value in for `N` steps, and takes out what arrives in each of them: `value` itself without a delay.
    #[inline(always)]
    pub(super) fn pass<const N: usize>(&mut self, value: f64) -> [f64; N] {
        let mut arriving = [value; N];
        let length = self.values.len();
        let ahead = self.values.get_mut(self.next..);
        if let Some(slots) = ahead.and_then(|slots| slots.first_chunk_mut()) {
            std::mem::swap(slots, &mut arriving);
            self.next += N;
        } else if length > 0 {
            for arriving in &mut arriving {
                std::mem::swap(&mut self.values[self.next % length], arriving);
                self.next = self.next % length + 1;
            }
        }
        if self.next == length {
            self.next = 0;
        }
        arriving
    }

    /// Makes the delay `steps` long. A shorter one loses what would have arrived next; a longer one repeats the latest value.
    pub(super) fn resize(&mut self, steps: usize) {
        self.values.rotate_left(self.next);
        self.next = 0;
        let latest = self.values.last().copied().unwrap_or(0.0);
        let lost = self.values.len().saturating_sub(steps);
        self.values.drain(..lost);
        self.values.resize(steps, latest);
    }
}
