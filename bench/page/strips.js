"use strict";
// Strip charts of channels, one of each unit, that can stand still.

// Height of a chart at least, in its unit: noise of a count fills no chart.
const LEAST_SPAN = { um: 4, mm: 0.01, V: 0.02 };
const unitOf = (unit) => ({ um: "µm", deg: "°", "count/256": "1/256 count" })[unit] ?? unit;
// Time between two drawings, ms.
const STRIP_MS = 50;

class Strips {
  constructor(box) {
    this.box = box;
    this.charts = [];
    this.isFrozen = false;
    this.drawnAt = 0;
    this.clear();
  }

  clear() {
    this.record = new Record(["t"], 1);
    this.width = 1;
    for (const { chart } of this.charts) chart.destroy();
    this.charts = [];
    this.box.replaceChildren();
  }

  // Begins with channels, as the answer to `watch` tells them, and the seconds across.
  begin({ channels, sample_time_s }, window_s) {
    this.clear();
    this.channels = channels;
    this.window_s = window_s;
    this.width = channels.length + 1;
    this.record = new Record(["t", ...channels.map(({ name }) => name)], Math.ceil(window_s / sample_time_s) + 1);
    this.isFrozen = false;
    this.rebuild();
  }

  push(samples) {
    // The last samples of channels that are no longer selected are of another width.
    if (samples.length % this.width === 0 && this.width > 1) this.record.push(samples);
  }

  rebuild() {
    for (const { chart } of this.charts) chart.destroy();
    this.charts = [];
    this.box.replaceChildren();
    const units = [...new Set((this.channels ?? []).map(({ unit }) => unit))];
    units.forEach((unit) => this.addChart(unit));
    this.draw();
  }

  addChart(unit) {
    const c = colours();
    const shown = this.channels.map((channel, index) => ({ ...channel, index })).filter((channel) => channel.unit === unit);
    const figure = document.createElement("figure");
    const readings = shown.map(({ name, index }) => {
      const reading = document.createElement("p");
      reading.className = "legend";
      reading.innerHTML = `<span class="key strand-${index % 8}"></span><b></b> <output></output>`;
      reading.querySelector("b").textContent = name;
      return { name, output: reading.querySelector("output"), reading };
    });
    const plot = document.createElement("div");
    plot.className = "plot strip";
    plot.setAttribute("role", "img");
    plot.setAttribute("aria-label", `${shown.map(({ name }) => name).join(", ")} over time, ${unitOf(unit) || "a number"}`);
    figure.append(...readings.map(({ reading }) => reading), plot);
    this.box.append(figure);
    const strand = getComputedStyle(document.documentElement);
    const chart = new Chart(plot, {
      cursor: { drag: { x: false, y: false }, points: { size: 6 } },
      scales: { x: { time: false, range: (_, low, high) => [high - this.window_s, high] }, y: { range: (_, low, high) => spanOf(low, high, LEAST_SPAN[unit] ?? 1e-3) } },
      axes: [axisOf(c, "", { size: 24, labelSize: 0, values: (_, ticks) => ticks.map((tick) => `${Number(tick.toFixed(3))} s`) }), axisOf(c, unitOf(unit), { size: 54 })],
      series: [{}, ...shown.map(({ index }) => ({ stroke: strand.getPropertyValue(`--strand-${index % 8}`).trim(), width: 1.3, points: { show: false } }))],
      hooks: { setCursor: [() => this.isFrozen && this.read()] },
    }, [[], ...shown.map(() => [])]);
    this.charts.push({ unit, names: shown.map(({ name }) => name), readings, chart });
  }

  freeze(isFrozen) {
    this.isFrozen = isFrozen;
    if (isFrozen) this.read();
    else this.draw();
  }

  // Draws if it is time to.
  tick(at) {
    if (this.isFrozen || at - this.drawnAt < STRIP_MS) return;
    this.drawnAt = at;
    this.draw();
  }

  draw() {
    const count = Math.min(this.record.end, this.record.capacity);
    if (!count || !this.charts.length) return;
    for (const { chart, names } of this.charts) chart.plot.setData([this.record.last("t", count), ...names.map((name) => this.record.last(name, count))].map((values) => values.slice()));
    this.read();
  }

  // Tells of each channel the value now, or at the cursor of a chart that stands still, its RMS and its largest size.
  read() {
    for (const { chart, readings } of this.charts) {
      const { data, cursor } = chart.plot;
      const at = this.isFrozen ? cursor.idx : null;
      readings.forEach(({ output }, index) => {
        const values = data[index + 1];
        if (!values.length) return;
        let [squares, largest] = [0, 0];
        for (const value of values) {
          squares += value * value;
          largest = Math.max(largest, Math.abs(value));
        }
        const here = at === null || at === undefined ? `now ${short(values.at(-1), 3)}` : `${short(values[at], 3)} at ${short(data[0][at], 3)} s`;
        output.textContent = `${here}, RMS ${short(Math.sqrt(squares / values.length), 3)}, largest ${short(largest, 3)}`;
      });
    }
  }
}

// The ends of a scale, a little wider than the values.
function spanOf(low, high, least) {
  if (!(low <= high)) return [-least / 2, least / 2];
  const middle = (low + high) / 2;
  const half = Math.max(0.55 * (high - low), least / 2);
  return [middle - half, middle + half];
}
