//! The thesis' headline figures, for comparison. They are printed results of its measurements on its own stage
//! (front matter); ours are simulated on ours.

/// One headline: what is compared, and its figure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Headline {
    /// What changed against what.
    pub comparison: &'static str,
    pub metric: Metric,
    /// Change, %.
    pub change_percent: f64,
    pub from: crate::experiment::configuration::Configuration,
    pub to: crate::experiment::configuration::Configuration,
}

/// A metric of the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    TrackingError,
    Glitch,
}

impl Metric {
    /// Its name in a table.
    pub const fn name(self) -> &'static str {
        match self {
            Self::TrackingError => "tracking error",
            Self::Glitch => "quadrant glitch",
        }
    }
}

/// The headlines, in the order of the abstract.
pub const HEADLINES: [Headline; 7] = {
    use crate::experiment::configuration::Configuration;
    use quadrant::control::feedback::LawKind::{self, NPid, Pid};
    use quadrant::feedforward::FeedforwardKind as F;
    const fn c(controller: LawKind, feedforward: F) -> Configuration {
        Configuration {
            controller,
            feedforward,
        }
    }
    const fn headline(
        comparison: &'static str,
        metric: Metric,
        change_percent: f64,
        from: Configuration,
        to: Configuration,
    ) -> Headline {
        Headline {
            comparison,
            metric,
            change_percent,
            from,
            to,
        }
    }
    [
        headline(
            "N-PID against PID",
            Metric::Glitch,
            -25.0,
            c(Pid, F::None),
            c(NPid, F::None),
        ),
        headline(
            "static feedforward, PID",
            Metric::TrackingError,
            -95.9,
            c(Pid, F::None),
            c(Pid, F::Static),
        ),
        headline(
            "static feedforward, N-PID",
            Metric::TrackingError,
            -95.8,
            c(NPid, F::None),
            c(NPid, F::Static),
        ),
        headline(
            "GMS feedforward, PID",
            Metric::Glitch,
            -33.3,
            c(Pid, F::None),
            c(Pid, F::Gms),
        ),
        headline(
            "GMS feedforward, N-PID",
            Metric::Glitch,
            -30.0,
            c(NPid, F::None),
            c(NPid, F::Gms),
        ),
        headline(
            "static + GMS + N-PID against PID",
            Metric::TrackingError,
            -96.5,
            c(Pid, F::None),
            c(NPid, F::Combined),
        ),
        headline(
            "static + GMS + N-PID against PID",
            Metric::Glitch,
            -50.0,
            c(Pid, F::None),
            c(NPid, F::Combined),
        ),
    ]
};
