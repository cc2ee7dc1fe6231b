//! The force that milling exerts on the table.
//!
//! The mechanistic model of a cutter with straight teeth, Y. Altintas, *Manufacturing Automation*, Cambridge University
//! Press, 2nd ed. 2012, chapter 2: a tooth at the immersion angle phi, counted from the normal of the feed towards it,
//! takes a chip of thickness `h = c sin(phi)` and is pushed back by `Ft = (Ktc h + Kte) a` along its path and
//! `Fr = (Krc h + Kre) a` towards the cutter's axis. Each spindle turn repeats the force with its teeth, every tooth its
//! own chip where the cutter runs out.

use std::f64::consts::{PI, TAU};

/// Milling of one material with one cutter at constant feed per tooth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Milling {
    /// Spindle speed, rev/min; above zero.
    pub spindle_rpm: f64,
    /// Teeth; 1 or more.
    pub teeth: u32,
    /// Axial depth of cut a, mm; zero or more.
    pub axial_depth_mm: f64,
    /// Feed per tooth c, mm; zero or more.
    pub feed_per_tooth_mm: f64,
    /// Angles at which a tooth enters and leaves the cut, rad, 0 to pi: (0, pi) is a slot, (0, pi/2) up-milling at half
    /// immersion.
    pub engagement_rad: (f64, f64),
    /// Ktc and Krc, N/mm^2.
    pub shearing_n_per_mm2: (f64, f64),
    /// Kte and Kre, N/mm.
    pub edge_n_per_mm: (f64, f64),
    /// Relative difference between the first tooth's chip and the mean, 0 to 1: the others follow a cosine over the turn.
    pub runout: f64,
}

/// A direction in the plane of the cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Component {
    Feed,
    Normal,
}

impl Milling {
    /// A slot in aluminium, 2 mm deep, two teeth at 3000 rev/min: 100 Hz, where a loop with the thesis' margins amplifies.
    /// The coefficients are of the order that handbooks give for aluminium alloys; chosen, not measured.
    pub fn slot() -> Self {
        Self {
            spindle_rpm: 3000.0,
            teeth: 2,
            axial_depth_mm: 2.0,
            feed_per_tooth_mm: 0.05,
            engagement_rad: (0.0, PI),
            shearing_n_per_mm2: (800.0, 250.0),
            edge_n_per_mm: (15.0, 10.0),
            runout: 0.1,
        }
    }

    /// A finishing cut in the same material: half immersion, 0.5 mm deep, four teeth at 12 000 rev/min, 800 Hz.
    pub fn finishing() -> Self {
        Self {
            spindle_rpm: 12_000.0,
            teeth: 4,
            axial_depth_mm: 0.5,
            feed_per_tooth_mm: 0.03,
            engagement_rad: (0.0, 0.5 * PI),
            ..Self::slot()
        }
    }

    /// Frequency with which teeth pass, Hz.
    pub fn tooth_passing_hz(&self) -> f64 {
        self.spindle_rpm / 60.0 * f64::from(self.teeth)
    }

    /// The force on the table at a time from the start of the cut, N.
    pub fn force_n(&self, component: Component, time_s: f64) -> f64 {
        let turned = (self.spindle_rpm / 60.0 * time_s).fract() * TAU;
        (0..self.teeth)
            .map(|tooth| {
                let place = TAU * f64::from(tooth) / f64::from(self.teeth);
                let angle = (turned + place).rem_euclid(TAU);
                self.tooth_n(component, angle, 1.0 + self.runout * place.cos())
            })
            .sum()
    }

    /// The force of a tooth at an angle whose chip is `share` of the mean's, N.
    fn tooth_n(&self, component: Component, angle: f64, share: f64) -> f64 {
        let (enters, leaves) = self.engagement_rad;
        if !(enters..leaves).contains(&angle) {
            return 0.0;
        }
        let (sin, cos) = angle.sin_cos();
        let chip = share * self.feed_per_tooth_mm * sin;
        let along = |shearing: f64, edge: f64| (shearing * chip + edge) * self.axial_depth_mm;
        let tangential = along(self.shearing_n_per_mm2.0, self.edge_n_per_mm.0);
        let radial = along(self.shearing_n_per_mm2.1, self.edge_n_per_mm.1);
        match component {
            Component::Feed => -tangential * cos - radial * sin,
            Component::Normal => tangential * sin - radial * cos,
        }
    }

    /// The mean force over a turn, N, in closed form: the integral of the model over the engagement.
    pub fn mean_force_n(&self, component: Component) -> f64 {
        let (enters, leaves) = self.engagement_rad;
        let between = |primitive: fn(f64) -> f64| primitive(leaves) - primitive(enters);
        let sin_sin = between(|angle| 0.5 * angle - 0.25 * (2.0 * angle).sin());
        let sin_cos = between(|angle| -0.25 * (2.0 * angle).cos());
        let (sin, cos) = (between(|angle| -angle.cos()), between(f64::sin));
        let (ktc, krc) = self.shearing_n_per_mm2;
        let (kte, kre) = self.edge_n_per_mm;
        let chip = self.feed_per_tooth_mm;
        let integral = match component {
            Component::Feed => -chip * (ktc * sin_cos + krc * sin_sin) - kte * cos - kre * sin,
            Component::Normal => chip * (ktc * sin_sin - krc * sin_cos) + kte * sin - kre * cos,
        };
        f64::from(self.teeth) / TAU * self.axial_depth_mm * integral
    }
}
