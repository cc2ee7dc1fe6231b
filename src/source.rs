//! The source of the axes: settings of the board's own, or a host.

/// The source of the server's axes.
#[cfg(not(feature = "lean"))]
pub(crate) type Source = quadrant::app::OwnSettings<'static, crate::board::SettingsFlash>;
/// The source of the server's axes.
#[cfg(feature = "lean")]
pub(crate) type Source = quadrant::app::HostAxes;
