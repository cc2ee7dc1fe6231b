//! The picture: 80 x 24 and larger.

use quadrant_cli::terminal::plain;
use quadrant_host::client::{columns, with_reset};
use quadrant_link::message::{Channel, MachineState};
use quadrant_written::fixed;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Chart, Clear, Dataset, GraphType, Paragraph};

use super::state::Watch;
use crate::connect::machine::axis_lines;
use crate::connect::{inputs, learnt};

const KEYS: [(&str, &str); 12] = [
    ("space", "freeze the charts, or let them go on"),
    ("left, right", "cursor of frozen charts; faster with shift"),
    ("[  ]", "half or twice the time across"),
    ("up, down", "choose a gain"),
    ("+  -  u", "nudge it by 5 %, or undo"),
    ("e  d", "enable, if pressed twice; disable"),
    ("g  s", "run the plan, if pressed twice; stop"),
    ("r", "reset the fault"),
    (
        "c  f",
        "capture the next motion, or the next fault, to the file",
    ),
    ("w", "write what is shown to the file"),
    ("ctrl-c", "stop; once more disables"),
    ("q", "leave"),
];

pub(super) fn draw(watch: &Watch, frame: &mut Frame) {
    let gains = u16::from(!watch.gains.is_empty());
    let learnt = learnt::lines(&watch.learning);
    let [head, fault, table, friction, lamps, gain, charts, message] = Layout::vertical([
        Constraint::Length(1),
        Constraint::Length(if watch.fault.is_some() { 2 } else { 0 }),
        Constraint::Length(4),
        Constraint::Length(learnt.len() as u16),
        Constraint::Length(1),
        Constraint::Length(gains),
        Constraint::Min(3),
        Constraint::Length(1),
    ])
    .areas(frame.area());
    frame.render_widget(headline(watch), head);
    if let Some(found) = &watch.fault {
        let axis = found
            .axis
            .map(|axis| format!(" of {axis}"))
            .unwrap_or_default();
        let text = [
            format!("fault {} {}{axis}: {}", found.code, found.name, found.cause),
            format!("remedy: {}", with_reset(&found.remedy)),
        ];
        let text: Vec<Line> = text.map(|line| Line::from(plain(&line))).into();
        frame.render_widget(Paragraph::new(text).style(Color::Red), fault);
    }
    frame.render_widget(axes(watch), table);
    let learnt: Vec<Line> = learnt.into_iter().map(Line::from).collect();
    frame.render_widget(Paragraph::new(learnt), friction);
    frame.render_widget(lamp_line(watch), lamps);
    frame.render_widget(gain_line(watch), gain);
    draw_charts(watch, frame, charts);
    frame.render_widget(
        Line::from(plain(&watch.message)).style(Modifier::DIM),
        message,
    );
    if watch.help {
        draw_keys(frame);
    }
}

fn headline(watch: &Watch) -> Line<'_> {
    let status = &watch.status;
    let colour = match status.state {
        MachineState::Enabled | MachineState::Homing => Color::Green,
        MachineState::Fault | MachineState::Stopping => Color::Red,
        MachineState::Start | MachineState::Disabled => Color::Yellow,
    };
    let motion = if status.running { "moving" } else { "at rest" };
    Line::from(vec![
        Span::styled(
            format!(" {} ", status.state.as_str()),
            Style::new().fg(Color::Black).bg(colour),
        ),
        Span::raw(format!(
            " {motion}  {:.1} s  {}{}",
            f64::from(status.tick) / watch.rate_hz,
            plain(&watch.machine),
            if watch.capturing {
                "  capture armed"
            } else {
                ""
            },
        )),
    ])
}

fn axes(watch: &Watch) -> Paragraph<'_> {
    let mut lines: Vec<Line> = axis_lines(&watch.status)
        .into_iter()
        .map(Line::from)
        .collect();
    if let Some(heads) = lines.first_mut() {
        heads.style = Modifier::DIM.into();
    }
    Paragraph::new(lines)
}

fn lamp_line(watch: &Watch) -> Line<'_> {
    let active = inputs::active(&watch.inputs);
    let mut spans = vec![Span::styled("inputs  ", Modifier::DIM)];
    if active.is_empty() {
        spans.push(Span::raw("none active"));
    }
    for input in active {
        spans.push(Span::styled(input, Style::new().fg(Color::Yellow)));
        spans.push(Span::raw("  "));
    }
    if let Some(refusal) = &watch.inputs.refusal {
        let refused = plain(&format!("  refused: {refusal}"));
        spans.push(Span::styled(refused, Modifier::DIM));
    }
    Line::from(spans)
}

fn gain_line(watch: &Watch) -> Line<'_> {
    let Some(gain) = watch.gains.get(watch.chosen) else {
        return Line::default();
    };
    let change = 100.0 * (gain.value / gain.original - 1.0);
    let change = if change.is_finite() && change.abs() > 1e-9 {
        format!("  {change:+.1} %")
    } else {
        String::new()
    };
    Line::from(vec![
        Span::styled("gain    ", Modifier::DIM),
        Span::raw(format!("{}  {:.6}{change}", gain.path, gain.value)),
        Span::styled(
            format!("  {} of {}", watch.chosen + 1, watch.gains.len()),
            Modifier::DIM,
        ),
    ])
}

fn draw_charts(watch: &Watch, frame: &mut Frame, area: Rect) {
    // As many as have room for three lines of curve.
    let count = watch
        .channels
        .len()
        .min(usize::from(area.height / 4).max(1));
    let areas = Layout::vertical(vec![Constraint::Ratio(1, count as u32); count]).split(area);
    for (index, area) in areas.iter().enumerate() {
        draw_chart(watch, index, frame, *area);
    }
}

fn draw_chart(watch: &Watch, index: usize, frame: &mut Frame, area: Rect) {
    let channel = watch.channels[index];
    let (samples, first) = watch.shown();
    let (unit, scale) = channel.shown_unit();
    let values = columns::values_mm(samples, index, &watch.resolutions_mm);
    let end_s = samples
        .numbers
        .last()
        .map_or(0.0, |last| f64::from(*last) * samples.sample_time_s);
    let points: Vec<(f64, f64)> = samples
        .numbers
        .iter()
        .zip(&values)
        .skip(first)
        .map(|(number, value)| {
            let time_s = f64::from(*number) * samples.sample_time_s - end_s;
            (time_s, scale * value)
        })
        .collect();
    let window_s = watch.window_s;
    let (low, high) = bounds(&points, least_span(channel));
    let cursor_s = window_s * (watch.cursor - 1.0);
    let cursor = [(cursor_s, low), (cursor_s, high)];
    let mut datasets = vec![
        Dataset::default()
            .marker(Marker::Braille)
            .graph_type(GraphType::Line)
            .style(Color::Cyan)
            .data(&points),
    ];
    if watch.is_frozen() {
        datasets.push(
            Dataset::default()
                .marker(Marker::Braille)
                .graph_type(GraphType::Line)
                .style(Color::Yellow)
                .data(&cursor),
        );
    }
    let chart = Chart::new(datasets)
        .block(Block::new().title(title(watch, channel, unit, &points, cursor_s)))
        .x_axis(Axis::default().bounds([-window_s, 0.0]))
        .y_axis(Axis::default().bounds([low, high]).labels([
            format!("{:>9}", fixed(low, 3)),
            format!("{:>9}", fixed(high, 3)),
        ]));
    frame.render_widget(chart, area);
}

/// The channel, its value now or at the cursor, its RMS and its largest size.
fn title(
    watch: &Watch,
    channel: Channel,
    unit: &str,
    points: &[(f64, f64)],
    cursor_s: f64,
) -> String {
    let rms = (points.iter().map(|(_, value)| value * value).sum::<f64>()
        / points.len().max(1) as f64)
        .sqrt();
    let largest = points
        .iter()
        .fold(0.0, |most: f64, (_, value)| most.max(value.abs()));
    let at = if watch.is_frozen() {
        points.iter().find(|(time_s, _)| *time_s >= cursor_s)
    } else {
        points.last()
    };
    let now = match at {
        Some((time_s, value)) if watch.is_frozen() => {
            format!("{} at {} s", fixed(*value, 3), fixed(*time_s, 4))
        }
        Some((_, value)) => format!("now {}", fixed(*value, 3)),
        None => "no sample yet".to_owned(),
    };
    format!(
        "{channel}, {unit}: {now}, RMS {rms:.3}, largest {largest:.3}, over {:.3} s",
        watch.window_s
    )
}

/// Smallest height of a chart: noise of a count fills no chart.
fn least_span(channel: Channel) -> f64 {
    match channel.shown_unit().0 {
        "um" => 4.0,
        "mm" => 0.01,
        "V" => 0.02,
        _ => 1e-3,
    }
}

/// The bounds of a chart, a little wider than its values.
fn bounds(points: &[(f64, f64)], least_span: f64) -> (f64, f64) {
    let (low, high) = points.iter().filter(|(_, value)| value.is_finite()).fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), (_, value)| (low.min(*value), high.max(*value)),
    );
    if low > high {
        return (-0.5 * least_span, 0.5 * least_span);
    }
    let middle = 0.5 * (low + high);
    let half = (0.55 * (high - low)).max(0.5 * least_span);
    (middle - half, middle + half)
}

fn draw_keys(frame: &mut Frame) {
    let lines: Vec<Line> = KEYS
        .iter()
        .map(|(key, what)| Line::from(format!("{key:>12}  {what}")))
        .collect();
    let (width, height) = (74.min(frame.area().width), lines.len() as u16 + 2);
    let area = frame
        .area()
        .centered(Constraint::Length(width), Constraint::Length(height));
    frame.render_widget(Clear, area);
    frame.render_widget(
        Paragraph::new(lines).block(Block::bordered().title(" keys ")),
        area,
    );
}
