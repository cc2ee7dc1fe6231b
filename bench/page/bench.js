"use strict";
// The page: the bench runs in real time, the controls turn it, the plots show it.

const $ = (id) => document.getElementById(id);
const AXES = ["x", "y", "z"];
// Seconds of samples that are kept, and most of a frame that is caught up with.
const KEPT_S = 90;
const LONGEST_FRAME_S = 0.1;
// Time between two drawings, ms.
const DRAWING_MS = 33;

// The latest samples of every signal.
class Record {
  constructor(names, capacity) {
    this.capacity = capacity;
    this.signals = Object.fromEntries(names.map((name) => [name, new Float64Array(2 * capacity)]));
    this.names = names;
    this.end = 0;
  }
  clear() {
    this.end = 0;
  }
  push(samples) {
    for (let at = 0; at < samples.length; at += this.names.length) {
      if (this.end === 2 * this.capacity) {
        for (const signal of Object.values(this.signals)) signal.copyWithin(0, this.capacity);
        this.end = this.capacity;
      }
      this.names.forEach((name, index) => (this.signals[name][this.end] = samples[at + index]));
      this.end += 1;
    }
  }
  // The last `count` samples of a signal, as far as there are any, up to `before` samples before the latest.
  last(name, count, before = 0) {
    const end = Math.max(this.end - before, 0);
    return this.signals[name].subarray(Math.max(end - Math.round(count), 0), end);
  }
}

let bench, form, record, motion, errorPlot, polarPlot, loopPlot, bodePlot;
let axis = 0;
let paused = false;
let step = null;
let settleUntil = 0;
const scores = new Map();
const meters = { since: performance.now(), simulated: 0, law: 0, drawing: 0 };

const now = () => record.last("time_s", 1)[0] ?? 0;
const turnTime = () => (2 * Math.PI * motion.radius_mm) / (motion.feed_mm_min / 60);
const turnSamples = () => (turnTime() * form.rate_hz) / form.sample_ticks;
const short = (value, digits = 1) => value.toFixed(digits).replace("-", "−");

function say(text, bad = false) {
  $("message").textContent = text;
  $("message").classList.toggle("bad", bad);
  if (text && guide.step !== null) guide.report(text, bad);
}

// Asks, shows a refusal, and returns whether it was done.
function tryTo(body, refused = (text) => say(text, true)) {
  try {
    bench.request(body);
    refused("");
    return true;
  } catch (error) {
    refused(error.message);
    return false;
  }
}

// A number with its slider. `change` returns whether the value was taken.
function numberControl({ label, unit, range, slider, value, meaning }, change, whenDone = () => {}) {
  const row = document.createElement("div");
  row.className = "number";
  const id = `n${numberControl.count++}`;
  row.innerHTML = `<label for="${id}"></label><input type="number" id="${id}" step="any"><span class="unit"></span>`;
  const [name, input, units] = row.children;
  name.textContent = label;
  row.title = meaning;
  units.textContent = unit;
  [input.min, input.max] = range;
  const show = (value) => (input.value = Number(value.toPrecision(5)));
  show(value);
  const refusal = document.createElement("span");
  refusal.className = "refused";
  refusal.setAttribute("role", "status");
  const refused = (text) => (refusal.textContent = text);
  let slide = null;
  if (slider) {
    slide = document.createElement("input");
    slide.type = "range";
    slide.min = 0;
    slide.max = 1000;
    slide.setAttribute("aria-label", `${label}, ${unit || "share"}`);
    const [low, high] = slider;
    // Over a wide span equal ways are equal ratios.
    const isLog = low > 0 && high / low > 5;
    const value_of = (place) => (isLog ? low * (high / low) ** (place / 1000) : low + ((high - low) * place) / 1000);
    const place_of = (value) => 1000 * (isLog ? Math.log(value / low) / Math.log(high / low) : (value - low) / (high - low));
    slide.value = place_of(value);
    const tell = () => slide.setAttribute("aria-valuetext", `${input.value} ${unit}`);
    tell();
    slide.addEventListener("input", () => {
      const wanted = Number(value_of(Number(slide.value)).toPrecision(4));
      show(wanted);
      tell();
      change(wanted, refused);
    });
    slide.addEventListener("change", whenDone);
    input.addEventListener("change", () => (slide.value = place_of(Number(input.value))));
    row.append(slide);
  }
  input.addEventListener("change", () => {
    if (input.value !== "" && change(Number(input.value), refused)) whenDone();
  });
  row.append(refusal);
  return row;
}
numberControl.count = 0;

function choices(select, offered, chosen) {
  select.replaceChildren(...offered.map(({ name, label }) => new Option(label, name, false, name === chosen)));
}

// The name of a setting in a few words: the head of its meaning.
const head = (meaning) => meaning.split(/[,;:.(]/)[0];

function settingControl(setting) {
  const sides = { positive: ", towards +", negative: ", towards −" };
  const side = sides[setting.field.split(".")[2]] ?? "";
  return numberControl({ ...setting, label: head(setting.meaning) + side }, (value, refused) => {
    const done = tryTo({ set: { path: setting.path, value } }, refused);
    leaveTour();
    showLoop();
    return done;
  });
}

// Takes everything that the controls show from the bench.
function show() {
  const shown = bench.request({ show: { axis } });
  const { controls } = shown;
  motion = shown.motion;
  choices($("law"), controls.laws, controls.law);
  choices($("feedforward"), controls.feedforwards, controls.feedforward);
  for (const group of ["feedback", "shares", "friction"]) {
    $(group).replaceChildren(...controls[group].map(settingControl));
  }
  for (const name of document.querySelectorAll(".axis-name")) name.textContent = AXES[axis];
  $("knobs").replaceChildren(...form.knobs.map((knob, index) =>
    numberControl({ ...knob, range: [knob.least, knob.most], slider: [knob.least, knob.most], value: shown.knobs[index] }, (value, refused) => {
      const done = tryTo({ turn: { knob: knob.name, value } }, refused);
      forgetScores();
      showLoop();
      return done;
    })));
  $("motion").replaceChildren(...form.motion.map((number) =>
    numberControl({ ...number, slider: number.range, value: motion[number.name] }, (value, refused) => start({ ...motion, [number.name]: value }, refused))));
  showLoop();
}

function showLoop() {
  const loop = bench.request({ loop: { axis } });
  bodePlot.draw(loop);
  $("margins-settings").textContent = loop.settings_plant?.margins ?? "the settings have no plant";
  $("margins-true").textContent = loop.true_stage?.margins ?? "the law has no linear form";
}

function begin() {
  record.clear();
  forgetScores();
}

function start(wanted, refused) {
  const done = tryTo({ start: { motion: wanted } }, refused);
  if (done) {
    motion = wanted;
    begin();
  }
  return done;
}

function restart() {
  bench.request("restart");
  begin();
}

function chooseLaw() {
  leaveTour();
  tryTo({ choose: { law: $("law").value, feedforward: $("feedforward").value } });
  show();
}

// The tour.

function leaveTour() {
  step = null;
  showStep();
}

function goTo(index) {
  const { law, feedforward } = TOUR[index];
  if (!tryTo({ choose: { law, feedforward } })) return;
  step = index;
  scores.delete(index);
  settle();
  show();
  showStep();
}

// The last turn was of another law or stage: half a turn to settle, then a whole one, and at the start the lead-in.
function settle() {
  settleUntil = now() + 1.5 * turnTime() + (now() < 1 ? 1 : 0);
}

// Scores on another stage, or of another motion, are not to be compared.
function forgetScores() {
  scores.clear();
  settle();
  showStep();
}

function showStep() {
  const buttons = [...$("steps").children];
  buttons.forEach((button, index) => button.setAttribute("aria-pressed", String(index === step)));
  if (step !== null) {
    $("step-title").textContent = `${step + 1}. ${TOUR[step].title}`;
    $("step-text").textContent = TOUR[step].text;
    $("step-look").textContent = TOUR[step].look;
  }
  $("scores").tBodies[0].replaceChildren(...TOUR.map(({ title }, index) => {
    const row = document.createElement("tr");
    row.className = index === step ? "now" : "";
    const score = scores.get(index);
    row.insertCell().textContent = `${index + 1}. ${title}`;
    for (let column = 0; column < 3; column++) {
      row.insertCell().textContent = score ? short(score[column]) : index === step ? "…" : "";
    }
    return row;
  }));
}

// Largest and RMS error of an axis and the roundness of the circle over the last turn.
function score(of) {
  const turn = turnSamples();
  let [largest, squares, high, low] = [0, 0, -Infinity, Infinity];
  const errors = record.last(`${AXES[of]}.error_um`, turn);
  for (const error of errors) {
    largest = Math.max(largest, Math.abs(error));
    squares += error * error;
  }
  for (const value of record.last("radial_um", turn)) {
    if (value !== value) continue;
    high = Math.max(high, value);
    low = Math.min(low, value);
  }
  return [largest, Math.sqrt(squares / Math.max(errors.length, 1)), Math.max(high - low, 0)];
}

// Drawing.

function draw() {
  const turn = turnSamples();
  const shown = Math.min(Math.max(2 * turnTime(), 4), 20) * form.rate_hz / form.sample_ticks;
  const name = AXES[axis];
  errorPlot.draw(record.last("time_s", shown), record.last(`${name}.error_um`, shown));
  const circle = (count, before) => ({ angle: record.last("angle_rad", count, before), radial: record.last("radial_um", count, before) });
  polarPlot.draw([circle(turn, Math.round(0.98 * turn)), circle(0.98 * turn)], motion.radius_mm);
  drawFriction(turn, name);
  const [largest, rms] = score(axis);
  const roundness = score(0)[2];
  $("error-score").textContent = `reference minus true position; over one turn: largest ${short(largest)} µm, RMS ${short(rms)} µm`;
  $("circle-score").textContent = `roundness ${short(roundness)} µm`;
}

// Half the way around the reversal that is shown, µm.
const REVERSAL_UM = 100;

function drawFriction(turn, name) {
  // A turn of z takes as long as one of the circle.
  const of = (signal) => record.last(`${name}.${signal}`, turn);
  const position = of("position_mm");
  const curves = [{ y: of("friction_v"), colour: "two" }, { y: of("feedforward_v"), colour: "one" }];
  if (document.querySelector('[name="stroke"]:checked').value === "whole") {
    let [low, high] = [Infinity, -Infinity];
    for (const place of position) {
      low = Math.min(low, place);
      high = Math.max(high, place);
    }
    if (!(high > low)) [low, high] = [-1, 1];
    const margin = 0.03 * (high - low);
    loopPlot.draw(position, curves, [low - margin, high + margin], "position, mm");
    return;
  }
  // The reversal at the largest position of the last turn, and both ways beside it.
  let peak = 0;
  for (let i = 1; i < position.length; i++) if (position[i] > position[peak]) peak = i;
  let [first, last] = [peak, peak];
  const near = (i) => i >= 0 && i < position.length && position[peak] - position[i] < 1.3e-3 * REVERSAL_UM;
  while (near(first - 1)) first -= 1;
  while (near(last + 1)) last += 1;
  const cut = (signal) => signal.subarray(first, last + 1);
  const from = cut(position).map((place) => 1e3 * (place - position[peak]));
  loopPlot.draw(from, curves.map(({ y, colour }) => ({ y: cut(y), colour })), [-REVERSAL_UM, 0.05 * REVERSAL_UM], "way from the reversal, µm");
}

function measure(at) {
  const elapsed = at - meters.since;
  if (elapsed < 1000) return;
  const share = (ms) => `${short((100 * ms) / elapsed)} % of a core`;
  $("pace").textContent = paused ? "paused" : `× ${short((1000 * meters.simulated) / elapsed, 2)}`;
  $("load").textContent = share(meters.law);
  $("drawing").textContent = share(meters.drawing);
  Object.assign(meters, { since: at, simulated: 0, law: 0, drawing: 0 });
  const { fault } = bench.request({ show: { axis } });
  $("fault").hidden = !fault;
  if (fault) $("fault-text").textContent = fault;
}

let lastFrame = performance.now();
let owed = 0;
let drawn = 0;

function frame(at) {
  const elapsed = Math.min((at - lastFrame) / 1000, LONGEST_FRAME_S);
  lastFrame = at;
  if (!paused && elapsed > 0) {
    owed += elapsed * Number($("speed").value) * form.rate_hz;
    const ticks = Math.floor(owed);
    owed -= ticks;
    const before = performance.now();
    record.push(bench.advance(ticks));
    meters.law += performance.now() - before;
    meters.simulated += ticks / form.rate_hz;
    $("time").textContent = `${short(now())} s`;
    if (step !== null && !scores.has(step) && now() >= settleUntil) {
      scores.set(step, score(0));
      showStep();
    }
  }
  if (at - drawn >= DRAWING_MS) {
    drawn = at;
    const before = performance.now();
    draw();
    meters.drawing += performance.now() - before;
  }
  measure(at);
  requestAnimationFrame(frame);
}

// Controls that are always there.

async function take(file) {
  if (!file) return;
  let done;
  try {
    done = bench.request({ load: { text: await file.text(), name: file.name } });
  } catch (error) {
    return say(error.message, true);
  }
  begin();
  leaveTour();
  show();
  say(done);
}

function connect() {
  $("pause").addEventListener("click", () => {
    paused = !paused;
    $("pause").textContent = paused ? "Go on" : "Pause";
  });
  for (const id of ["restart", "fault-restart"]) $(id).addEventListener("click", restart);
  for (const id of ["law", "feedforward"]) $(id).addEventListener("change", chooseLaw);
  $("axis").addEventListener("change", (event) => {
    axis = Number(event.target.value);
    show();
  });
  $("knobs-reset").addEventListener("click", () => {
    for (const { name, default: value } of form.knobs) bench.request({ turn: { knob: name, value } });
    forgetScores();
    show();
  });
  $("tell").addEventListener("click", () => {
    if (tryTo("tell-friction")) say("the law has the stage's own friction");
    show();
  });
  $("file").addEventListener("change", (event) => {
    take(event.target.files[0]);
    event.target.value = "";
  });
  $("save").addEventListener("click", () => {
    const text = bench.request("save");
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type: "application/toml" }));
    link.download = "settings.toml";
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
  });
  $("reset").addEventListener("click", () => {
    bench.request("reset");
    begin();
    leaveTour();
    show();
    say("the settings as commissioned, on the stage as it was");
  });
  for (const kind of ["dragover", "dragleave", "drop"]) {
    document.addEventListener(kind, (event) => {
      event.preventDefault();
      $("drop").classList.toggle("over", kind === "dragover");
      if (kind === "drop") take(event.dataTransfer.files[0]);
    });
  }
  const redraw = () => [errorPlot, bodePlot].forEach((plot) => plot.rebuild());
  $("theme").addEventListener("change", (event) => {
    document.documentElement.dataset.theme = event.target.value;
    redraw();
  });
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
  $("steps").replaceChildren(...TOUR.map(({ title }, index) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = `${index + 1} ${title}`;
    button.addEventListener("click", () => goTo(index));
    return button;
  }));
}

async function openBenchView() {
  bench = await openBench();
  form = bench.request("describe");
  const names = [...form.signals, ...AXES.flatMap((name) => form.axis_signals.map((signal) => `${name}.${signal}`))];
  record = new Record(names, (KEPT_S * form.rate_hz) / form.sample_ticks);
  errorPlot = new ErrorPlot($("error-plot"));
  polarPlot = new PolarPlot($("polar-plot"));
  loopPlot = new LoopPlot($("loop-plot"));
  bodePlot = new BodePlot($("gain-plot"), $("phase-plot"));
  connect();
  show();
  goTo(0);
  guide.begin();
  requestAnimationFrame(frame);
}
