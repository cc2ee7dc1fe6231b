"use strict";
// Plots: time and frequency by uPlot, position and angle on a canvas.

// Colours of the page as it is now, light or dark.
function colours() {
  const style = getComputedStyle(document.documentElement);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: of("ink"), label: of("label"), soft: of("soft"), rule: of("rule"), hair: of("hair"), one: of("one"), two: of("two"), old: of("old"), paper: of("paper") };
}

const FONT = '11px system-ui, -apple-system, "Segoe UI", Roboto, "DejaVu Sans", sans-serif';

// The smallest of some steps times a power of ten that is not below a value.
function nice(value, steps = [1, 2, 5, 10]) {
  const power = Math.floor(Math.log10(Math.max(value, 1e-9)));
  return steps.map((step) => Number(`${step}e${power}`)).find((step) => step >= value * 0.999);
}

// A scale that grows at once and shrinks only when much too large, so that a live plot does not tremble.
class Scale {
  constructor(least, steps) {
    this.least = least;
    this.steps = steps;
    this.value = least;
  }
  fit(largest) {
    const wanted = Math.max(nice(largest * 1.05, this.steps), this.least);
    if (wanted > this.value || wanted < 0.6 * this.value) this.value = wanted;
    return this.value;
  }
}

const FINE = [1, 1.5, 2, 3, 4, 5, 6, 8, 10];

function decimals(step) {
  return Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
}

function axisOf(c, label, more = {}) {
  return { stroke: c.label, font: FONT, labelFont: FONT, label, labelSize: 16, size: 44, gap: 4, grid: { stroke: c.hair, width: 1 }, ticks: { stroke: c.hair, width: 1, size: 4 }, ...more };
}

// A uPlot in a box whose size it keeps.
class Chart {
  constructor(box, options, data) {
    this.box = box;
    box.replaceChildren();
    this.plot = new uPlot({ ...this.size(), legend: { show: false }, ...options }, data, box);
    this.observer = new ResizeObserver(() => this.plot.setSize(this.size()));
    this.observer.observe(box);
  }
  size() {
    return { width: Math.max(this.box.clientWidth, 120), height: Math.max(this.box.clientHeight, 120) };
  }
  destroy() {
    this.observer.disconnect();
    this.plot.destroy();
  }
}

class ErrorPlot {
  constructor(box) {
    this.box = box;
    this.scale = new Scale(1, FINE);
    this.rebuild();
  }
  rebuild() {
    this.chart?.destroy();
    const c = colours();
    this.chart = new Chart(this.box, {
      cursor: { drag: { x: false, y: false }, points: { size: 6 } },
      scales: { x: { time: false }, y: { range: () => [-this.scale.value, this.scale.value] } },
      axes: [axisOf(c, "simulated time, s", { size: 30 }), axisOf(c, "error, µm")],
      series: [{}, { stroke: c.one, width: 1.3, points: { show: false } }],
    }, [[], []]);
  }
  draw(times, errors) {
    let largest = 0;
    for (const error of errors) largest = Math.max(largest, Math.abs(error));
    this.scale.fit(largest);
    this.chart.plot.setData([times, errors]);
  }
}

class BodePlot {
  constructor(gainBox, phaseBox) {
    this.boxes = [gainBox, phaseBox];
    this.loop = null;
    this.rebuild();
  }
  rebuild() {
    this.charts?.forEach((chart) => chart.destroy());
    const c = colours();
    const lines = [0, -180];
    const ranges = [[-60, 60], [-450, 0]];
    this.charts = this.boxes.map((box, index) => new Chart(box, {
      cursor: { drag: { x: false, y: false } },
      scales: { x: { time: false, distr: 3 }, y: { range: () => ranges[index] } },
      axes: [
        axisOf(c, "frequency, Hz", { size: 30, values: (_, ticks) => ticks.map((tick) => ([1, 10, 100, 1000].includes(tick) ? String(tick) : "")) }),
        axisOf(c, ["gain, dB", "phase, °"][index], index === 1 ? { incrs: [90, 180], space: 24 } : { incrs: [20, 40], space: 24 }),
      ],
      series: [
        {},
        { stroke: c.one, width: 1.8, points: { show: false } },
        { stroke: c.two, width: 1.8, dash: [7, 5], points: { show: false } },
      ],
      hooks: { draw: [(plot) => this.mark(plot, lines[index], c)] },
    }, [[], [], []]));
    if (this.loop) this.draw(this.loop);
  }
  // The line at 0 dB or -180 degrees, and the gain crossover.
  mark(plot, level, c) {
    const { ctx, bbox } = plot;
    const line = (x0, y0, x1, y1) => {
      ctx.beginPath();
      ctx.moveTo(x0, y0);
      ctx.lineTo(x1, y1);
      ctx.stroke();
    };
    ctx.save();
    ctx.lineWidth = devicePixelRatio;
    ctx.strokeStyle = c.rule;
    const y = plot.valToPos(level, "y", true);
    line(bbox.left, y, bbox.left + bbox.width, y);
    const crossover = this.loop?.settings_plant?.crossover_hz;
    if (crossover) {
      ctx.setLineDash([3 * devicePixelRatio, 3 * devicePixelRatio]);
      const x = plot.valToPos(crossover, "x", true);
      line(x, bbox.top, x, bbox.top + bbox.height);
    }
    ctx.restore();
  }
  draw(loop) {
    this.loop = loop;
    const none = loop.frequency_hz.map(() => null);
    ["gain_db", "phase_deg"].forEach((curve, index) => {
      const of = (which) => loop[which]?.[curve] ?? none;
      this.charts[index].plot.setData([loop.frequency_hz, of("settings_plant"), of("true_stage")]);
    });
  }
}

// A canvas in CSS pixels, cleared.
function sheet(canvas) {
  const ratio = devicePixelRatio;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext("2d");
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = FONT;
  context.lineJoin = "round";
  return { context, width, height };
}

class PolarPlot {
  constructor(canvas) {
    this.canvas = canvas;
    this.scale = new Scale(1, FINE);
  }
  // Angles and radial deviations of the turn before and of the turn so far, oldest first, and the latest of them.
  draw(turns, radius_mm) {
    const c = colours();
    const { context, width, height } = sheet(this.canvas);
    const [x, y] = [width / 2, height / 2];
    const outer = Math.min(width / 2 - 34, height / 2 - 18);
    const nominal = 0.68 * outer;
    let largest = 0;
    for (const { radial } of turns) for (const value of radial) if (value === value) largest = Math.max(largest, Math.abs(value));
    const scale = this.scale.fit(largest);
    const radius = (deviation) => nominal + (deviation / scale) * (outer - nominal);
    context.lineWidth = 1;
    for (const share of [-1, -0.5, 0.5, 1]) {
      context.strokeStyle = c.hair;
      context.beginPath();
      context.arc(x, y, radius(share * scale), 0, 2 * Math.PI);
      context.stroke();
    }
    context.beginPath();
    for (let quarter = 0; quarter < 4; quarter++) {
      const [dx, dy] = [Math.cos((quarter * Math.PI) / 2), -Math.sin((quarter * Math.PI) / 2)];
      context.moveTo(x + radius(-scale) * dx, y + radius(-scale) * dy);
      context.lineTo(x + outer * dx, y + outer * dy);
    }
    context.stroke();
    context.strokeStyle = c.label;
    context.setLineDash([5, 4]);
    context.beginPath();
    context.arc(x, y, nominal, 0, 2 * Math.PI);
    context.stroke();
    context.setLineDash([]);
    context.fillStyle = c.label;
    context.textAlign = "center";
    context.textBaseline = "middle";
    context.fillText("0° +x", Math.min(x + outer + 19, width - 15), y);
    context.fillText("180°", x - outer - 17, y);
    context.fillText("90° +y", x, y - outer - 9);
    context.fillText("270°", x, y + outer + 10);
    const diagonal = Math.SQRT1_2;
    // Outside the outer circle and inside the inner one, where no curve goes.
    const [outermost, innermost] = [scale, -scale].map((deviation) => radius(deviation) * diagonal);
    context.textAlign = "left";
    context.fillText(`+${scale} µm`, x + outermost + 3, y + outermost + 5);
    context.textAlign = "right";
    context.fillText(`−${scale} µm`, x + innermost - 3, y + innermost - 5);
    context.fillStyle = c.soft;
    context.textAlign = "center";
    context.fillText("radius", x, y - 7);
    context.fillText(`${radius_mm} mm`, x, y + 7);
    turns.forEach(({ angle, radial }, index) => {
      context.strokeStyle = index === turns.length - 1 ? c.one : c.old;
      context.lineWidth = index === turns.length - 1 ? 1.7 : 1.2;
      context.beginPath();
      let drawing = false;
      for (let i = 0; i < angle.length; i++) {
        if (radial[i] !== radial[i]) {
          drawing = false;
          continue;
        }
        const at = radius(radial[i]);
        const [px, py] = [x + at * Math.cos(angle[i]), y - at * Math.sin(angle[i])];
        if (drawing) context.lineTo(px, py);
        else context.moveTo(px, py);
        drawing = true;
      }
      context.stroke();
    });
    const last = turns.at(-1);
    const end = last ? last.angle.length - 1 : -1;
    if (end >= 0 && last.radial[end] === last.radial[end]) {
      const at = radius(last.radial[end]);
      context.fillStyle = c.one;
      context.beginPath();
      context.arc(x + at * Math.cos(last.angle[end]), y - at * Math.sin(last.angle[end]), 4, 0, 2 * Math.PI);
      context.fill();
    }
  }
}

class LoopPlot {
  constructor(canvas) {
    this.canvas = canvas;
    this.scale = new Scale(0.05);
  }
  // Curves over x; each a list of y with its colour. `span` holds the ends of x.
  draw(x, curves, span, label) {
    const c = colours();
    const { context, width, height } = sheet(this.canvas);
    const [left, right, top, bottom] = [50, 8, 8, 36];
    let largest = 0;
    for (const { y } of curves) for (const value of y) largest = Math.max(largest, Math.abs(value));
    const most = this.scale.fit(largest);
    const across = (value) => left + ((value - span[0]) / (span[1] - span[0])) * (width - left - right);
    const up = (value) => top + ((most - value) / (2 * most)) * (height - top - bottom);
    context.lineWidth = 1;
    context.fillStyle = c.label;
    context.strokeStyle = c.hair;
    context.textBaseline = "middle";
    context.textAlign = "right";
    const step = most / 2;
    for (let i = -2; i <= 2; i++) {
      const y = up(i * step);
      context.strokeStyle = i === 0 ? c.rule : c.hair;
      context.beginPath();
      context.moveTo(left, y);
      context.lineTo(width - right, y);
      context.stroke();
      context.fillText((i * step).toFixed(decimals(step)).replace("-", "−"), left - 6, y);
    }
    context.textAlign = "center";
    const mesh = nice((span[1] - span[0]) / 6);
    context.strokeStyle = c.hair;
    for (let value = Math.ceil(span[0] / mesh - 1e-9) * mesh; value <= span[1] + 1e-9 * mesh; value += mesh) {
      context.beginPath();
      context.moveTo(across(value), top);
      context.lineTo(across(value), height - bottom);
      context.stroke();
      context.fillText((value + 0).toFixed(decimals(mesh)).replace(/^-(?=[0.]*$)/, "").replace("-", "−"), across(value), height - bottom + 11);
    }
    context.fillText(label, left + (width - left - right) / 2, height - 7);
    context.save();
    context.translate(11, top + (height - top - bottom) / 2);
    context.rotate(-Math.PI / 2);
    context.fillText("V at the amplifier's input", 0, 0);
    context.restore();
    context.save();
    context.beginPath();
    context.rect(left, top, width - left - right, height - top - bottom);
    context.clip();
    for (const { y, colour } of curves) {
      context.strokeStyle = c[colour];
      context.lineWidth = 1.7;
      context.beginPath();
      for (let i = 0; i < x.length; i++) {
        if (i === 0) context.moveTo(across(x[i]), up(y[i]));
        else context.lineTo(across(x[i]), up(y[i]));
      }
      context.stroke();
    }
    context.restore();
  }
}
