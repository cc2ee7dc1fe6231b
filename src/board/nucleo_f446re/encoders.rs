//! Three quadrature encoders, each counted by a timer in all four edges.

use quadrant::hal;
use stm32f4xx_hal::gpio::{PA0, PA1, PB8, PB9, PC6, PC7};
use stm32f4xx_hal::hal_02::Qei as _;
use stm32f4xx_hal::pac::{TIM2, TIM3, TIM5};
use stm32f4xx_hal::qei::Qei;
use stm32f4xx_hal::rcc::Rcc;

/// Three position encoders.
pub(crate) struct Encoders {
    x: Qei<TIM2>,
    y: Qei<TIM5>,
    z: Qei<TIM3>,
    /// The 16-bit counter of z, extended.
    z_count: u32,
}

impl Encoders {
    /// Starts counting from zero.
    pub(super) fn new(
        x: (TIM2, PB8, PB9),
        y: (TIM5, PA0, PA1),
        z: (TIM3, PC6, PC7),
        rcc: &mut Rcc,
    ) -> Self {
        Self {
            x: Qei::new(x.0, (x.1, x.2), rcc),
            y: Qei::new(y.0, (y.1, y.2), rcc),
            z: Qei::new(z.0, (z.1, z.2), rcc),
            z_count: 0,
        }
    }
}

impl hal::Encoders for Encoders {
    /// All three wrap at 32 bits.
    #[inline(always)]
    fn counts(&mut self) -> [u32; 3] {
        // Right as long as z moves less than 32768 counts in a tick.
        let moved = self
            .z
            .count()
            .wrapping_sub(self.z_count as u16)
            .cast_signed();
        self.z_count = self.z_count.wrapping_add_signed(moved.into());
        [self.x.count(), self.y.count(), self.z_count]
    }
}
