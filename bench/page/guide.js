"use strict";
// The guide: what the page is, in six steps, each with something to press and its result.

// Where the browser remembers that the guide was closed.
const GUIDE_SEEN = "quadrant-bench-guide";
// Longest time for which the bench runs ahead at once, s.
const LONGEST_AHEAD_S = 60;
// Motions that the guide offers: radius, mm, and feed, mm/min.
const GUIDE_MOTIONS = [[5, 300], [10, 900], [20, 2400]];

const GUIDE = [
  {
    title: "What this is",
    text: "The firmware's control law drives a simulated machine: x and y run a circle. Where an axis reverses, friction holds it until the law pulls hard enough. The error jumps: a quadrant glitch. Look at the spikes in the plots below.",
    actions: [{ label: "Run a turn with PID alone", run: () => chosen("pid", "none", () => `Largest error of ${AXES[axis]} over the turn: ${um(turnError())}.`) }],
  },
  {
    title: "Choose a motion",
    text: "Friction shows most where an axis turns slowly. Choose a circle; Motion in the controls takes any other.",
    actions: GUIDE_MOTIONS.map(([radius_mm, feed_mm_min]) => ({
      label: `${radius_mm} mm at ${feed_mm_min} mm/min`,
      run: (refused) => {
        if (!start({ radius_mm, feed_mm_min }, refused)) return "";
        show();
        return `A turn takes ${short(turnTime())} s. Largest error of ${AXES[axis]}: ${um(turnError())}.`;
      },
    })),
  },
  {
    title: "With friction feedforward, and without",
    text: "Feedforward adds the voltage that friction takes, before an error has grown. Both runs have the same feedback and gains.",
    actions: [{ label: "Run both", run: (refused) => both($("law").value, refused) }],
  },
  {
    title: "Change a gain",
    text: "Every control acts at once, while the axes move. Ki is the integral gain of PID, under Feedback. A larger one follows friction faster, until the loop oscillates: a well-tuned PID leaves less for the feedforward to take away.",
    actions: [4, 1 / 4].map((factor) => ({
      label: factor > 1 ? `Ki × ${factor}` : `Ki ÷ ${1 / factor}`,
      run: (refused) => {
        if (!tryTo({ choose: { law: "pid", feedforward: "none" } }, refused)) return "";
        const { feedback } = bench.request({ show: { axis } }).controls;
        const { path, value: old, unit } = feedback.find(({ field }) => field === "feedback.pid.ki_v_per_mm_s");
        const value = Number((factor * old).toPrecision(4));
        if (!tryTo({ set: { path, value } }, refused)) return "";
        return `Ki of ${AXES[axis]} from ${old} to ${value} ${unit}. ${both("pid", refused)}`;
      },
    })),
  },
  {
    title: "Open your own",
    text: "Open or drop a file: settings that quadrant commission wrote, or a stage with your axis' mass, friction and encoder. It stays on this computer.",
    actions: [
      { label: "Open a file", run: () => $("file").click() },
      { label: "Try the example of a stage", run: () => void take(new File([bench.request("example")], "stage.toml")) },
      { label: "Back to the built-in stage", run: () => void $("reset").click() },
    ],
  },
  {
    title: "Where to go next",
    text: "Turn the friction of the stage: the law does not know of it. Compare six laws in the table that takes this guide's place. On your computer: quadrant compare for the figures, quadrant commission to tune an axis that nobody knows; the documentation begins at docs/start-simulated.md.",
    actions: [{ label: "Double the friction", run: (refused) => (tryTo({ turn: { knob: "friction", value: 2 } }, refused) ? (forgetScores(), show(), both($("law").value, refused)) : "") }],
  },
];

const um = (value) => `${short(value)} µm`;

// The largest error over a turn with what is set now: the bench runs ahead until it has settled.
function turnError() {
  const seconds = Math.min(1.5 * turnTime(), LONGEST_AHEAD_S) + (now() < 1 ? 1 : 0);
  record.push(bench.advance(Math.round(seconds * form.rate_hz)));
  const { fault } = bench.request({ show: { axis } });
  if (fault) throw new Error(`${fault}. Press Start again.`);
  return score(axis)[0];
}

// Chooses a law and returns what `result` says of it.
function chosen(law, feedforward, result) {
  bench.request({ choose: { law, feedforward } });
  return result();
}

function both(law) {
  const [without, fed] = ["none", "combined"].map((feedforward) => chosen(law, feedforward, turnError));
  const change = short(100 * (fed / without - 1), 0);
  return `Largest error of ${AXES[axis]} without feedforward ${um(without)}, with it ${um(fed)}: ${change} %.`;
}

const guide = {
  step: null,

  // Opens the guide, unless it was closed in this browser before.
  begin() {
    $("guide-open").addEventListener("click", () => this.go(0));
    $("guide-close").addEventListener("click", () => this.close());
    $("guide-back").addEventListener("click", () => this.go(this.step - 1));
    $("guide-next").addEventListener("click", () => this.go(this.step + 1));
    $("guide").addEventListener("keydown", ({ key }) => {
      if (key === "Escape") this.close();
      if (key === "ArrowRight" && this.step < GUIDE.length - 1) this.go(this.step + 1);
      if (key === "ArrowLeft") this.go(this.step - 1);
    });
    if (this.stored() === null) this.go(0);
  },

  // A browser may forbid a page to store anything; the guide then comes again.
  stored(value) {
    try {
      return value === undefined ? localStorage.getItem(GUIDE_SEEN) : localStorage.setItem(GUIDE_SEEN, value);
    } catch {
      return null;
    }
  },

  go(step) {
    if (step < 0) return;
    if (step === GUIDE.length) return this.close();
    this.step = step;
    const { title, text, actions } = GUIDE[step];
    $("guide").hidden = false;
    $("tour").hidden = true;
    $("guide-title").textContent = `${step + 1} of ${GUIDE.length}: ${title}`;
    $("guide-text").textContent = text;
    $("guide-actions").replaceChildren(...actions.map(({ label, run }) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = label;
      button.addEventListener("click", () => this.run(run));
      return button;
    }));
    $("guide-back").disabled = step === 0;
    $("guide-next").textContent = step === GUIDE.length - 1 ? "Done" : "Next";
    this.report("");
  },

  run(action) {
    leaveTour();
    try {
      const result = action((text) => this.report(text, true));
      if (result) this.report(result);
    } catch (error) {
      this.report(error.message, true);
    }
    show();
  },

  // Shows a result, or a refusal.
  report(text, bad = false) {
    $("guide-result").textContent = text;
    $("guide-result").classList.toggle("bad", bad);
  },

  close() {
    this.step = null;
    this.stored("closed");
    $("guide").hidden = true;
    $("tour").hidden = false;
    $("guide-open").focus();
  },
};
