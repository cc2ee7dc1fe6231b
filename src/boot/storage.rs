//! Static storage for all large objects: the stack has no room for them.

use core::mem::MaybeUninit;

use quadrant::app::capture::CAPTURE_WORDS;
use quadrant::app::{Axis, Control, Intake, Queues, Server};
use quadrant::scalar::Scalar;
#[cfg(not(feature = "lean"))]
use quadrant::settings::StageSettings;
#[cfg(not(feature = "lean"))]
use quadrant::store::BUFFER_BYTES;

use crate::source::Source;

/// All large objects.
pub(crate) struct StaticStorage<S: Scalar + 'static> {
    #[cfg(not(feature = "lean"))]
    pub(super) settings: SettingsStorage,
    pub(super) axes: [MaybeUninit<Axis<S>>; 4],
    pub(super) queues: Queues<'static, S>,
    pub(super) capture: [u32; CAPTURE_WORDS],
    pub(super) control: MaybeUninit<Control<'static, 'static, S>>,
    pub(super) intake: MaybeUninit<Intake<'static>>,
    pub(super) server: MaybeUninit<Server<'static, 'static, S, Source>>,
}

impl<S: Scalar> StaticStorage<S> {
    /// Returns the storage before the start.
    pub(crate) const fn new() -> Self {
        Self {
            #[cfg(not(feature = "lean"))]
            settings: SettingsStorage::new(),
            axes: [const { MaybeUninit::uninit() }; 4],
            queues: Queues::new(),
            capture: [0; CAPTURE_WORDS],
            control: MaybeUninit::uninit(),
            intake: MaybeUninit::uninit(),
            server: MaybeUninit::uninit(),
        }
    }
}

/// Settings, and what they need on their way to and from flash.
#[cfg(not(feature = "lean"))]
pub(super) struct SettingsStorage {
    pub(super) in_force: MaybeUninit<StageSettings>,
    pub(super) draft: MaybeUninit<StageSettings>,
    pub(super) buffer: [u8; BUFFER_BYTES],
}

#[cfg(not(feature = "lean"))]
impl SettingsStorage {
    /// Returns the storage before the start.
    pub(super) const fn new() -> Self {
        Self {
            in_force: MaybeUninit::uninit(),
            draft: MaybeUninit::uninit(),
            buffer: [0; BUFFER_BYTES],
        }
    }
}
