//! The columns that voltage is explained by.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Dyn, QR, SVD};

use super::model::{Span, Structure};
use super::signals::{MotionFitSettings, Signals};
use crate::identify::latest::Latest;

/// The parts of a model that are linear, each the coefficient of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Term {
    /// M', V s²/mm.
    Inertia,
    /// Viscous friction, both ways or one, V s/mm.
    Viscous(Way),
    /// Coulomb friction as a sign, V.
    Coulomb,
    /// An element that slips at this knot, V.
    Element(usize),
    /// Fs - Fc, V.
    Drop,
    /// Offset, V.
    Offset,
    /// Change of the offset, or of friction's level, over half of the record, V.
    Drift(Part),
    /// The same over half of the travel, V.
    AlongTravel(Part),
}

/// The part of the force that changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Offset,
    Level,
}

impl Part {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Offset => "offset",
            Self::Level => "level",
        }
    }
}

/// A sense of motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Way {
    Both,
    Positive,
    Negative,
}

impl Term {
    /// True if a negative coefficient would be no friction.
    fn is_friction(self) -> bool {
        matches!(self, Self::Element(_) | Self::Coulomb | Self::Viscous(_))
    }
}

/// Stribeck velocities whose columns are kept.
const KEPT_VELOCITIES: usize = 16;

/// The regression of one record: its columns but for those that depend on the Stribeck velocity.
#[derive(Debug)]
pub(super) struct Regression<'a> {
    signals: &'a Signals,
    settings: &'a MotionFitSettings,
    pub(super) terms: Vec<Term>,
    /// Decimated columns; that of `Drop` is filled in by the velocity.
    columns: Arc<DMatrix<f64>>,
    /// The columns of the Stribeck velocities asked for last: a search asks for each several times.
    latest: Latest<(f64, Arc<DMatrix<f64>>)>,
    /// Hysteresis without weights, at the full rate: what the drop acts on.
    hysteresis: Vec<f64>,
    /// The voltage, smoothed, at the full rate.
    voltage_v: Vec<f64>,
    /// Velocity at the decimated samples, mm/s.
    pub(super) velocity_mm_s: Vec<f64>,
    /// Time and travel that changes are counted over.
    pub(super) span: Span,
}

impl<'a> Regression<'a> {
    /// Columns of a record; changes are counted over `span`, the record's own or that of the record that a model comes from.
    pub(super) fn new(
        signals: &'a Signals,
        settings: &'a MotionFitSettings,
        structure: Structure,
        span: Span,
    ) -> Self {
        let velocity = &signals.velocity_mm_s;
        let one_way = |sign: f64| -> Vec<f64> {
            velocity
                .iter()
                .map(|v| if v * sign > 0.0 { *v } else { 0.0 })
                .collect()
        };
        let mut terms = vec![Term::Inertia];
        let mut columns = vec![signals.acceleration_mm_s2.clone()];
        if structure.directed_viscous {
            terms.extend([Term::Viscous(Way::Positive), Term::Viscous(Way::Negative)]);
            columns.extend([one_way(1.0), one_way(-1.0)]);
        } else {
            terms.push(Term::Viscous(Way::Both));
            columns.push(velocity.clone());
        }
        let hysteresis = if structure.presliding {
            let elements: Vec<Vec<f64>> = settings
                .knots_mm
                .iter()
                .map(|&knot| maxwell_slip(&signals.position_mm, knot))
                .collect();
            let share = 1.0 / elements.len() as f64;
            let mean = (0..velocity.len())
                .map(|k| share * elements.iter().map(|element| element[k]).sum::<f64>())
                .collect();
            terms.extend((0..elements.len()).map(Term::Element));
            columns.extend(elements);
            mean
        } else {
            let sign: Vec<f64> = velocity
                .iter()
                .map(|v| if *v == 0.0 { 0.0 } else { v.signum() })
                .collect();
            terms.push(Term::Coulomb);
            columns.push(sign.clone());
            sign
        };
        terms.push(Term::Offset);
        columns.push(vec![1.0; velocity.len()]);
        if structure.stribeck {
            terms.push(Term::Drop);
            columns.push(vec![0.0; velocity.len()]);
        }
        let mut change = |term: fn(Part) -> Term, share: Vec<f64>| {
            let level = share.iter().zip(&hysteresis).map(|(a, h)| a * h).collect();
            terms.extend([term(Part::Offset), term(Part::Level)]);
            columns.extend([share, level]);
        };
        if structure.drift {
            let times = (0..velocity.len()).map(|k| k as f64 * signals.sample_time_s);
            change(Term::Drift, times.map(|t| span.time_share(t)).collect());
        }
        if structure.along_travel {
            let positions = signals.position_mm.iter();
            change(
                Term::AlongTravel,
                positions.map(|&x| span.travel_share(x)).collect(),
            );
        }
        let columns: Vec<DVector<f64>> = columns
            .iter()
            .map(|column| DVector::from_vec(signals.decimated(column, settings)))
            .collect();
        Self {
            signals,
            settings,
            terms,
            columns: Arc::new(DMatrix::from_columns(&columns)),
            latest: Latest::new(KEPT_VELOCITIES),
            hysteresis,
            voltage_v: signals.smoothed(&signals.voltage_v, settings),
            velocity_mm_s: signals.decimated(velocity, settings),
            span,
        }
    }

    /// The dead time, if it is given.
    pub(super) fn known_dead_time_s(&self) -> Option<f64> {
        self.settings.dead_time_s
    }

    /// The part of the dead time that is the voltage's hold, s.
    pub(super) fn hold_s(&self) -> f64 {
        self.signals.hold_s
    }

    pub(super) fn rows(&self) -> usize {
        self.columns.nrows()
    }

    /// The rows about which the axis slides one way, faster than `moving_mm_s`; all rows where these are few.
    pub(super) fn sliding_rows(&self, moving_mm_s: f64) -> Vec<usize> {
        let velocity = &self.velocity_mm_s;
        let slides = |row: &usize| {
            let begin = row.saturating_sub(FILTER_ROWS);
            let about = &velocity[begin..velocity.len().min(row + FILTER_ROWS + 1)];
            about
                .iter()
                .all(|v| v * velocity[*row].signum() > moving_mm_s)
        };
        let sliding: Vec<usize> = (0..self.rows()).filter(slides).collect();
        if 4 * sliding.len() < self.rows() {
            return (0..self.rows()).collect();
        }
        sliding
    }

    /// The columns at a Stribeck velocity.
    pub(super) fn columns_at(&self, stribeck_velocity_mm_s: f64) -> Arc<DMatrix<f64>> {
        let Some(index) = self.terms.iter().position(|term| *term == Term::Drop) else {
            return self.columns.clone();
        };
        let same = |(velocity, _): &(f64, _)| *velocity == stribeck_velocity_mm_s;
        if let Some((_, columns)) = self.latest.find(same) {
            return columns;
        }
        let drop: Vec<f64> = self
            .hysteresis
            .iter()
            .zip(&self.signals.velocity_mm_s)
            .map(|(h, v)| h * (-v.abs() / stribeck_velocity_mm_s).exp())
            .collect();
        let drop = self.signals.decimated(&drop, self.settings);
        let mut columns = (*self.columns).clone();
        columns.set_column(index, &DVector::from_vec(drop));
        let columns = Arc::new(columns);
        self.latest.keep((stribeck_velocity_mm_s, columns.clone()));
        columns
    }

    /// The voltage that was commanded a dead time before each row.
    pub(super) fn voltage_at(&self, dead_time_s: f64) -> DVector<f64> {
        let late = dead_time_s / self.signals.sample_time_s;
        let last = self.voltage_v.len() - 1;
        let decimation = self.settings.decimation(self.signals.sample_time_s);
        DVector::from_fn(self.rows(), |row, _| {
            let place = ((row * decimation) as f64 - late).max(0.0);
            let below = (place as usize).min(last);
            let share = place - below as f64;
            let above = (below + 1).min(last);
            (1.0 - share) * self.voltage_v[below] + share * self.voltage_v[above]
        })
    }
}

/// Rows either side of one that the decimation's filter mixes with it.
const FILTER_ROWS: usize = 3;

/// The force of an element of unit level that slips at `knot_mm`, driven by a position, -1 to 1.
fn maxwell_slip(position_mm: &[f64], knot_mm: f64) -> Vec<f64> {
    let mut stretch = 0.0;
    let mut previous = position_mm.first().copied().unwrap_or(0.0);
    position_mm
        .iter()
        .map(|&position| {
            stretch = f64::clamp(stretch + position - previous, -knot_mm, knot_mm);
            previous = position;
            stretch / knot_mm
        })
        .collect()
}

/// Least squares over some rows, with no negative friction: a term that asks for it is left out.
pub(super) struct Solver<'a> {
    terms: &'a [Term],
    rows: &'a [usize],
    /// The decompositions used last: a search over the dead time changes the voltage alone.
    latest: Latest<Arc<Decomposed>>,
}

/// Some columns and some rows of a regression, decomposed.
struct Decomposed {
    columns: Arc<DMatrix<f64>>,
    kept: Vec<usize>,
    /// Norms by which the columns were divided.
    sizes: Vec<f64>,
    orthogonal: QR<f64, Dyn, Dyn>,
    triangle: SVD<f64, Dyn, Dyn>,
}

impl Decomposed {
    /// Nothing, if a column is zero.
    fn of(columns: &Arc<DMatrix<f64>>, kept: &[usize], rows: &[usize]) -> Option<Self> {
        let chosen = columns.select_columns(kept).select_rows(rows);
        // Columns of one size, so that the cut-off of the singular values means dependence and not units.
        let sizes: Vec<f64> = chosen.column_iter().map(|column| column.norm()).collect();
        if sizes.contains(&0.0) {
            return None;
        }
        let mut scaled = chosen;
        for (mut column, size) in scaled.column_iter_mut().zip(&sizes) {
            column /= *size;
        }
        // The triangle of a QR decomposition has the columns' singular values, and is small.
        let orthogonal = scaled.qr();
        Some(Self {
            columns: columns.clone(),
            kept: kept.to_vec(),
            sizes,
            triangle: orthogonal.r().svd(true, true),
            orthogonal,
        })
    }
}

impl<'a> Solver<'a> {
    /// For some rows of a regression's columns.
    pub(super) fn new(terms: &'a [Term], rows: &'a [usize]) -> Self {
        Self {
            terms,
            rows,
            latest: Latest::new(DECOMPOSITIONS),
        }
    }

    /// The decomposition of some columns; nothing, if one is zero.
    fn decomposed(&self, columns: &Arc<DMatrix<f64>>, kept: &[usize]) -> Option<Arc<Decomposed>> {
        let same =
            |found: &Arc<Decomposed>| Arc::ptr_eq(&found.columns, columns) && found.kept == kept;
        if let Some(found) = self.latest.find(same) {
            return Some(found);
        }
        let made = Arc::new(Decomposed::of(columns, kept, self.rows)?);
        self.latest.keep(made.clone());
        Some(made)
    }

    /// The coefficients that explain a voltage best; nothing, if some columns cannot be distinguished.
    pub(super) fn solve(
        &self,
        columns: &Arc<DMatrix<f64>>,
        voltage_v: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        let mut kept: Vec<usize> = (0..self.terms.len()).collect();
        let targets = voltage_v.select_rows(self.rows);
        loop {
            let decomposed = self.decomposed(columns, &kept)?;
            let mut rotated = targets.clone();
            decomposed.orthogonal.q_tr_mul(&mut rotated);
            let rotated = rotated.rows(0, kept.len()).into_owned();
            let triangle = &decomposed.triangle;
            let smallest = triangle.singular_values.min();
            if smallest < DEPENDENCE_RATIO * triangle.singular_values.max() {
                return None;
            }
            let solution = triangle.solve(&rotated, 0.0).ok()?;
            let worst = kept
                .iter()
                .enumerate()
                .filter(|&(place, &term)| self.terms[term].is_friction() && solution[place] < 0.0)
                .min_by(|a, b| solution[a.0].total_cmp(&solution[b.0]));
            match worst {
                Some((place, _)) => {
                    kept.remove(place);
                }
                None => {
                    let mut coefficients = DVector::zeros(self.terms.len());
                    for (place, &term) in kept.iter().enumerate() {
                        coefficients[term] = solution[place] / decomposed.sizes[place];
                    }
                    return Some(coefficients);
                }
            }
        }
    }
}

/// Decompositions that are kept: those of two Stribeck velocities, each with up to seven elements left out.
const DECOMPOSITIONS: usize = 16;

/// Largest ratio of the smallest to the largest singular value of scaled columns that count as dependent.
const DEPENDENCE_RATIO: f64 = 1e-9;
