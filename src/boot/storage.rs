//! Static storage for all large objects: the stack has no room for them.

use core::mem::MaybeUninit;

use quadrant::app::capture::CAPTURE_WORDS;
use quadrant::app::{Axis, Control, Intake, Queues, Server};
use quadrant::store::BUFFER_BYTES;
use quadrant_law::scalar::Scalar;
use quadrant_settings::StageSettings;

use crate::board::SettingsFlash;

/// All large objects.
pub(crate) struct StaticStorage<S: Scalar + 'static> {
    pub(super) settings: MaybeUninit<StageSettings>,
    pub(super) draft: MaybeUninit<StageSettings>,
    pub(super) axes: [MaybeUninit<Axis<S>>; 4],
    pub(super) queues: Queues<'static, S>,
    pub(super) buffer: [u8; BUFFER_BYTES],
    pub(super) capture: [u32; CAPTURE_WORDS],
    pub(super) control: MaybeUninit<Control<'static, 'static, S>>,
    pub(super) intake: MaybeUninit<Intake<'static>>,
    pub(super) server: MaybeUninit<Server<'static, 'static, S, SettingsFlash>>,
}

impl<S: Scalar> StaticStorage<S> {
    /// Returns the storage before the start.
    pub(crate) const fn new() -> Self {
        Self {
            settings: MaybeUninit::uninit(),
            draft: MaybeUninit::uninit(),
            axes: [const { MaybeUninit::uninit() }; 4],
            queues: Queues::new(),
            buffer: [0; BUFFER_BYTES],
            capture: [0; CAPTURE_WORDS],
            control: MaybeUninit::uninit(),
            intake: MaybeUninit::uninit(),
            server: MaybeUninit::uninit(),
        }
    }
}
