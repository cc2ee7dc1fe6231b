//! Marks of points and dashes of lines, alike on the page, in its legends and in image files.

use super::Dash;

/// The shape of a point. Colour alone does not carry meaning in print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mark {
    Circle,
    Square,
    Diamond,
    Triangle,
    Cross,
}

impl Mark {
    /// The mark of the `index`th of several equal series.
    pub(super) const fn nth(index: usize) -> Self {
        const CYCLE: [Mark; 5] = [
            Mark::Circle,
            Mark::Square,
            Mark::Diamond,
            Mark::Triangle,
            Mark::Cross,
        ];
        CYCLE[index % CYCLE.len()]
    }

    /// Corners about the middle, for about the area of a circle of radius 1; a circle has none.
    pub(super) const fn corners(self) -> &'static [(f64, f64)] {
        match self {
            Self::Circle => &[],
            Self::Square => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
            Self::Diamond => &[(0.0, -1.3), (1.3, 0.0), (0.0, 1.3), (-1.3, 0.0)],
            Self::Triangle => &[(0.0, -1.25), (1.15, 0.8), (-1.15, 0.8)],
            Self::Cross => &[
                (0.0, -0.45),
                (0.75, -1.2),
                (1.2, -0.75),
                (0.45, 0.0),
                (1.2, 0.75),
                (0.75, 1.2),
                (0.0, 0.45),
                (-0.75, 1.2),
                (-1.2, 0.75),
                (-0.45, 0.0),
                (-1.2, -0.75),
                (-0.75, -1.2),
            ],
        }
    }

    /// The outline in SVG path commands relative to the middle, `r` px about it.
    pub(super) fn outline(self, r: f64) -> String {
        let corners = self.corners();
        if corners.is_empty() {
            let d = 2.0 * r;
            return format!("m-{r} 0a{r} {r} 0 1 0 {d} 0a{r} {r} 0 1 0 -{d} 0z");
        }
        let mut from = (0.0, 0.0);
        let mut path = String::new();
        for (i, &(x, y)) in corners.iter().enumerate() {
            let command = if i == 0 { 'm' } else { 'l' };
            path += &format!("{command}{:.2} {:.2}", r * (x - from.0), r * (y - from.1));
            from = (x, y);
        }
        path + "z"
    }
}

impl Dash {
    /// Lengths of dashes and gaps, px, as SVG takes them.
    pub(super) const fn pattern(self) -> Option<&'static str> {
        match self {
            Self::Solid | Self::Points => None,
            Self::Dashed => Some("6 4"),
            Self::Dotted => Some("2 3"),
        }
    }
}
