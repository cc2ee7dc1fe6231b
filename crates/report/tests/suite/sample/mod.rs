//! Pages that have everything a page can have.

use quadrant_report::{
    Block, Cell, Colour, Column, DeviationTrace, Figure, Lines, Page, Plot, PolarDeviation,
    Provenance, Scale, Section, Series, Style, Table,
};

pub(crate) fn lines(id: &str, series: usize, samples: usize) -> Figure {
    let x: Vec<f64> = (0..samples).map(|i| i as f64 * 1e-4).collect();
    let series = (0..series)
        .map(|s| Series {
            name: format!("law {s} </script><b>"),
            x: x.clone(),
            y: x.iter()
                .map(|t| (t * 7.0 + s as f64).sin() * 12.345_678_9)
                .collect(),
            style: Style::nth(s),
        })
        .collect();
    let plot = Plot::Lines(Lines {
        x_label: "Time (s)".into(),
        y_label: "Error (µm)".into(),
        series,
        ..Lines::default()
    });
    Figure {
        id: id.into(),
        caption: "Error over time.".into(),
        plot,
    }
}

pub(crate) fn circle() -> Figure {
    let angle_rad: Vec<f64> = (0..10_000).map(|i| i as f64 * 1e-3).collect();
    let deviation_um = angle_rad.iter().map(|a| 4.0 * (2.0 * a).sin()).collect();
    let trace = DeviationTrace {
        name: "PID".into(),
        angle_rad,
        deviation_um,
        style: Style::solid(Colour::Blue),
    };
    let plot = PolarDeviation {
        radius_mm: 30.0,
        x_label: "x (mm)".into(),
        y_label: "y (mm)".into(),
        traces: vec![trace],
    };
    Figure {
        id: "circle".into(),
        caption: "Circle.".into(),
        plot: Plot::PolarDeviation(plot),
    }
}

pub(crate) fn table(id: &str) -> Table {
    Table {
        id: id.into(),
        caption: "Errors & glitches.".into(),
        columns: vec![Column::new("Law"), Column::with_unit("Error", "µm")],
        rows: vec![
            vec![Cell::text("N-PID"), Cell::number(1.25, 1)],
            vec![Cell::text("<none>"), Cell::Missing],
        ],
    }
}

pub(crate) fn page(blocks: Vec<Block>) -> Page {
    Page {
        title: "Friction compensation".into(),
        subtitle: "A sample.".into(),
        provenance: Provenance {
            command: "quadrant --seed 7".into(),
            seed: Some(7),
            version: "0.1.0".into(),
        },
        sections: vec![Section {
            id: "section".into(),
            heading: "Tracking".into(),
            provenance: None,
            prose: vec!["Plain text, <b>not</b> markup.".into()],
            blocks,
        }],
    }
}

pub(crate) fn sample() -> Page {
    page(vec![
        Block::Table(table("errors")),
        Block::Figure(lines("error", 2, 5000)),
        Block::Figure(circle()),
    ])
}

/// A response on decades, with a gap in it.
pub(crate) fn response() -> Figure {
    let x: Vec<f64> = (0..300).map(|i| 10f64.powf(f64::from(i) / 100.0)).collect();
    let mut y: Vec<f64> = x
        .iter()
        .map(|f| 1.0 / (1.0 + f * f / 900.0).sqrt())
        .collect();
    y[120] = f64::NAN;
    let series = [
        Style::points(Colour::Ink),
        Style::dashed(Colour::Vermillion),
    ]
    .map(|style| Series {
        name: format!("{:?} & co.", style.dash),
        x: x.clone(),
        y: y.clone(),
        style,
    });
    let plot = Plot::Lines(Lines {
        x_label: "frequency (Hz)".into(),
        y_label: "gain (um/V)".into(),
        x_scale: Scale::Logarithmic,
        y_scale: Scale::Logarithmic,
        series: series.into(),
        ..Lines::default()
    });
    Figure {
        id: "response".into(),
        caption: "Response.".into(),
        plot,
    }
}

/// A page with every kind of block, a label of its own, and a section of another command.
pub(crate) fn full() -> Page {
    let mut page = sample();
    page.sections.push(Section {
        id: "other".into(),
        heading: "From elsewhere".into(),
        provenance: Some(Provenance {
            command: "quadrant circle --seed 9".into(),
            seed: Some(9),
            version: "0.1.0".into(),
        }),
        prose: vec!["Another command made this.".into()],
        blocks: vec![
            Block::Figure(response()),
            Block::Table(table("labelled")).labelled("Table 5.7"),
        ],
    });
    page
}
