"use strict";
// The machine's view: what a board reports, live, and the few buttons that move it. Every motion needs a press; nothing is
// repeated; Stop waits for nothing.

// Time between two polls of the machine, ms; its host counts as silent after 500.
const POLL_MS = 100;
// Silence after which nothing is shown as live any more, ms; longer while it erases its flash.
const SILENT_MS = 1000;
// Time for which a choice of channels stands before the board receives it, ms.
const CHOICE_MS = 150;
// Events that are kept.
const MOST_EVENTS = 60;
const STRIPPED = ["x.error", "y.error", "z.error"];
const MODES = { hold: "holds", plan: "moves", jog: "jogs", home: "homes", stream: "streams", stopping: "brakes", "open-loop": "is driven" };
// A number as text; one that is none is shown as a dash.
const told = (value, digits) => (value === null ? "–" : short(value, digits));

class MachineView {
  constructor(module) {
    this.module = module;
    this.link = null;
    this.isGreeted = this.isLive = this.moves = false;
    this.held = null;
    this.status = null;
    this.latched = null;
    this.pending = new Set();
    this.strips = new Strips($("m-strips"));
    this.draft = new Draft((body) => this.ask(body), (text, bad) => this.say(text, bad));
    this.wire();
    this.show();
    const frame = (at) => {
      if (this.isLive) this.strips.tick(at);
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
    setInterval(() => this.poll(), POLL_MS);
  }

  // The connection.

  async connect() {
    let port;
    try {
      port = await navigator.serial.requestPort();
    } catch (error) {
      this.say(error.name === "NotFoundError" ? "no port was chosen" : `no port: ${error.message}`, error.name !== "NotFoundError");
      return;
    }
    const link = new Link(this.module, port, {
      event: (event) => this.note(event),
      log: (text) => this.list(text),
      samples: (samples) => this.strips.push(samples),
      restarted: () => this.restarted(),
      lost: (reason) => this.lost(reason),
    });
    try {
      await link.open();
    } catch (error) {
      this.alarm(`The port could not be opened. Another program may hold it: a console, a debugger, another tab. Close that and connect again. (${error.message})`);
      return;
    }
    this.link = link;
    this.alarm("");
    this.say("connected; waiting for the board");
    this.show();
    await this.greet();
  }

  // Opens the session, and begins to watch.
  async greet() {
    try {
      this.identity = await this.ask("hello");
      for (const axis of [0, 1, 2]) await this.ask({ get: { path: `/axes/${axis}/encoder/resolution_mm` } });
      this.link.answeredAt = performance.now();
      this.isGreeted = this.isLive = true;
      this.say("connected");
      this.offerChannels();
      await this.watch();
    } catch (error) {
      if (this.link) this.alarm(`The board does not speak: ${error.message}. Check that it has power and Quadrant's firmware, and that this is its port.`);
    }
    this.show();
  }

  async disconnect() {
    if (!this.link) return;
    if (this.status?.drives && !this.warned) {
      this.warned = true;
      this.say("the outputs are on: Disable switches them off, Disconnect once more leaves them on", true);
      return;
    }
    this.release();
    this.ask("stop").catch(() => {});
    const { link } = this;
    this.forget();
    await link.close();
    this.say("disconnected");
  }

  lost(reason) {
    this.forget();
    this.alarm(`Connection lost: ${reason}. Nothing below is live. A board whose host falls silent stops what it started for it; its outputs may still be on. Look at the machine, check the cable, then connect again.`);
  }

  forget() {
    Object.assign(this, { link: null, isGreeted: false, isLive: false, held: null, moves: false, status: null, identity: null, warned: false });
    this.pending.clear();
    this.showFault(null);
    this.draft.clear();
    this.show();
  }

  // A board that has restarted is greeted again, but moved only by another press.
  restarted() {
    if (this.pending.has("hello")) return;
    Object.assign(this, { isGreeted: false, isLive: false, held: null, moves: false });
    this.alarm("The board has restarted: its outputs are off, and home positions are lost.");
    this.greet();
  }

  // Requests.

  ask(body) {
    if (!this.link) return Promise.reject(new Error("not connected"));
    const name = typeof body === "string" ? body : Object.keys(body)[0];
    this.pending.add(name);
    return this.link.ask(body).finally(() => this.pending.delete(name));
  }

  // Asks for something that is only to be done, once at a time, and says what came of it.
  async order(body, done) {
    const name = typeof body === "string" ? body : Object.keys(body)[0];
    if (this.pending.has(name)) return;
    this.acted();
    try {
      await this.ask(body);
      this.say(done);
    } catch (error) {
      this.say(error.message, true);
    }
  }

  // The user has gone on: what was shown before is not new any more.
  acted() {
    this.warned = false;
    if (this.isLive) this.alarm("");
  }

  // Stop and Disable: at once, whatever is waited for, each time.
  stop(why = "stopped") {
    this.release();
    this.safer("stop", why);
  }

  safer(body, done) {
    if (!this.link) return;
    this.moves = false;
    this.acted();
    this.ask(body).then(() => this.say(done), (error) => this.say(`${body}: ${error.message}`, true));
  }

  // Sets in motion: what this page has started, it stops when its user goes.
  move(body, done) {
    if (!this.link || !this.isLive || document.hidden) return;
    this.moves = true;
    this.movedAt = performance.now();
    this.acted();
    this.ask(body).then(() => this.say(done), (error) => this.say(error.message, true));
  }

  poll() {
    if (!this.link || document.hidden) return;
    const silent = this.pending.has("store") ? STORED_MS : SILENT_MS;
    const isSilent = performance.now() - this.link.answeredAt > silent;
    if (this.isLive && isSilent) {
      this.isLive = false;
      if (this.held) this.stop();
      this.alarm("The board does not answer: nothing below is live. What its host started, it stops by itself. Check its power and the cable.");
      this.show();
    }
    const now = performance.now();
    // An answer that was lost on the way holds no poll up for long.
    if (!this.isGreeted || (this.polling && now - this.polledAt < 3 * POLL_MS)) return;
    this.polling = true;
    this.polledAt = now;
    this.look(now).catch((error) => this.link && this.say(error.message, true)).finally(() => (this.polling = false));
  }

  async look(askedAt) {
    const [status, inputs] = await Promise.all([this.ask("status"), this.ask("inputs")]);
    if (!this.isLive) {
      this.isLive = true;
      this.alarm("");
      this.say("the board answers again");
    }
    // The last message may still be that they are on.
    if (!status.drives && (this.status?.drives || (status.fault !== null && !this.latched))) this.say("the outputs are off");
    this.status = status;
    this.inputs = inputs;
    if (status.at_rest && askedAt > (this.movedAt ?? 0) + 2 * POLL_MS) this.moves = false;
    if (!status.drives) this.held = null;
    if (status.fault !== (this.latched?.code ?? null)) this.showFault(await this.ask("fault"));
    this.show();
  }

  // Selects again once the choice has stood for a moment: the board takes one selection after the other.
  choose() {
    clearTimeout(this.choosing);
    this.choosing = setTimeout(() => this.link && this.watch(), CHOICE_MS);
  }

  async watch() {
    const channels = [...document.querySelectorAll("#m-channels input:checked")].map(({ value }) => value);
    const window_s = Number($("m-window").value);
    this.unfreeze();
    try {
      const begun = await this.ask({ watch: { channels, window_s } });
      if (begun) this.strips.begin(begun, window_s);
      else this.strips.clear();
    } catch (error) {
      this.say(error.message, true);
    }
  }

  // Jogging, while a button is held.

  press(axis, sign) {
    const speed = Number($("m-speed").value);
    if (this.held) return;
    if (!(speed > 0)) return this.say("give a speed above zero to jog at, mm/s", true);
    this.held = `${axis}${sign}`;
    this.move({ jog: { axis, velocity_mm_s: sign * speed } }, `${axis} jogs while you hold`);
  }

  // Lets go of a jog.
  release() {
    this.held = null;
  }

  letGo() {
    if (this.held) this.stop("stopped: the button was let go");
  }

  // The user is gone: what this page has started stops.
  leave() {
    if (this.held || this.moves) this.stop("stopped: the page was hidden");
  }

  // What is shown.

  say(text, bad = false) {
    $("m-message").textContent = text;
    $("m-message").classList.toggle("bad", bad);
  }

  alarm(text) {
    $("m-alarm").hidden = !text;
    $("m-alarm").textContent = text;
  }

  list(text, bad = false) {
    const line = document.createElement("li");
    line.textContent = text;
    line.classList.toggle("bad", bad);
    $("m-events").prepend(line);
    while ($("m-events").children.length > MOST_EVENTS) $("m-events").lastChild.remove();
  }

  note({ time_s, text, concerns_fault }) {
    this.list(`${short(time_s, 2)} s  ${text}`, concerns_fault);
  }

  showFault(fault) {
    this.latched = fault;
    $("m-fault").hidden = !fault;
    if (!fault) return;
    const of = fault.axis ? ` of ${fault.axis}` : "";
    $("m-fault-name").textContent = `Fault ${fault.code}: ${fault.name}${of}, at ${short(fault.time_s, 2)} s`;
    $("m-fault-cause").textContent = fault.cause;
    $("m-fault-remedy").textContent = fault.remedy;
  }

  show() {
    const { link, status, inputs, identity } = this;
    const isLive = Boolean(this.isLive && status);
    document.documentElement.dataset.live = String(isLive);
    $("m-connect").hidden = Boolean(link);
    $("m-disconnect").hidden = !link;
    $("m-stop").disabled = $("m-disable").disabled = !link;
    const drives = isLive && status.drives;
    $("m-enable").disabled = !isLive || drives || status.state === "fault";
    for (const button of document.querySelectorAll("[data-home], [data-jog]")) button.disabled = !drives;
    $("m-reset").disabled = !isLive;
    for (const control of document.querySelectorAll("#m-draft :is(input, button, select)")) control.disabled = !link;
    $("m-state").textContent = !link ? "not connected" : !isLive ? "not live" : status.at_rest ? `${status.state}, at rest` : `${status.state}, moving`;
    $("m-state").dataset.state = isLive ? status.state : "none";
    $("m-board").textContent = identity ? `${identity.board}, firmware ${identity.firmware}, ${identity.rate_hz / 1000} kHz` : "–";
    $("m-time").textContent = isLive ? `${short(status.time_s, 1)} s` : "–";
    $("m-counters").textContent = isLive ? `${status.bad_frames} bad frames, ${status.dropped_samples + status.dropped_events} dropped notices, ${status.overruns} late ticks` : "–";
    this.showAxes(isLive ? status.axes : []);
    this.showInputs(isLive ? inputs : null);
  }

  showAxes(axes) {
    $("m-axes").replaceChildren(...AXES.map((name, index) => {
      const axis = axes[index];
      const row = document.createElement("tr");
      const cells = axis
        ? [name, axis.homed ? "yes" : "no", MODES[axis.mode] ?? axis.mode, told(axis.position_mm, 4), told(axis.error_um, 2), `${told(axis.output_v, 3)}${axis.limited ? " (limit)" : ""}`, told(axis.high_mark, 3)]
        : [name, ..."–".repeat(6)];
      for (const text of cells) row.insertCell().textContent = text;
      return row;
    }));
  }

  showInputs(inputs) {
    $("m-inputs").replaceChildren(...(inputs?.inputs ?? []).map(({ name, active }) => {
      const lamp = document.createElement("li");
      lamp.textContent = name.replace(".", " ").replaceAll("-", " ");
      lamp.className = active ? "active" : "";
      lamp.dataset.input = name;
      lamp.setAttribute("aria-label", `${lamp.textContent}: ${active ? "active" : "not active"}`);
      return lamp;
    }));
    const pulses = inputs?.indexed.length ? `index pulses seen on ${inputs.indexed.join(", ")}` : inputs ? "no index pulse seen" : "";
    $("m-indexed").textContent = pulses;
    $("m-refusal").textContent = inputs?.refusal ? `Enable would be refused: ${inputs.refusal}` : "";
  }

  offerChannels() {
    if ($("m-channels").children.length) return;
    const groups = Map.groupBy(this.link.channels, ({ name }) => name.split(".")[0]);
    $("m-channels").replaceChildren(...[...groups].map(([source, channels]) => {
      const group = document.createElement("fieldset");
      group.innerHTML = "<legend></legend>";
      group.firstChild.textContent = source;
      for (const { name, unit } of channels) {
        const label = document.createElement("label");
        label.innerHTML = '<input type="checkbox"> ';
        Object.assign(label.firstChild, { value: name, checked: STRIPPED.includes(name) });
        label.append(name.split(".")[1], unit ? `, ${unitOf(unit)}` : "");
        group.append(label);
      }
      return group;
    }));
  }

  unfreeze() {
    this.strips.freeze(false);
    $("m-freeze").setAttribute("aria-pressed", "false");
    $("m-freeze").textContent = "Freeze";
  }

  // Controls.

  wire() {
    const on = (id, act, kind = "click") => $(id).addEventListener(kind, act);
    on("m-connect", () => this.connect());
    on("m-disconnect", () => this.disconnect());
    on("m-stop", () => this.stop());
    on("m-disable", () => {
      this.release();
      this.safer("disable", "outputs off");
    });
    on("m-enable", () => this.order("enable", "outputs on"));
    on("m-reset", () => this.order("reset-fault", "fault reset"));
    on("m-channels", () => this.choose(), "change");
    on("m-window", () => this.choose(), "change");
    on("m-freeze", () => {
      if (this.strips.isFrozen) return this.unfreeze();
      this.strips.freeze(true);
      $("m-freeze").setAttribute("aria-pressed", "true");
      $("m-freeze").textContent = "Go on";
    });
    for (const button of document.querySelectorAll("[data-home]")) {
      const axes = button.dataset.home.split(" ");
      button.addEventListener("click", () => this.move({ home: { axes } }, `homing ${axes.join(", ")}`));
    }
    for (const button of document.querySelectorAll("[data-jog]")) this.wireJog(button);
    // A pointer that is let go anywhere, and a user who is gone.
    for (const kind of ["pointerup", "pointercancel", "blur"]) addEventListener(kind, () => this.letGo());
    document.addEventListener("visibilitychange", () => (document.hidden ? this.leave() : this.link && (this.link.answeredAt = performance.now())));
    addEventListener("pagehide", () => this.leave());
    addEventListener("keydown", (event) => {
      if (event.key === "Escape") this.stop();
    }, true);
    on("m-theme", (event) => {
      document.documentElement.dataset.theme = event.target.value;
      this.strips.rebuild();
    }, "change");
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.strips.rebuild());
    if (!navigator.serial) {
      $("m-connect").disabled = true;
      $("m-no-serial").hidden = false;
    }
  }

  wireJog(button) {
    const [axis, sign] = [button.dataset.jog[0], button.dataset.jog[1] === "+" ? 1 : -1];
    button.addEventListener("pointerdown", (event) => {
      if (event.button !== 0) return;
      // A finger holds its button captive: it could not be seen to leave it.
      if (button.hasPointerCapture(event.pointerId)) button.releasePointerCapture(event.pointerId);
      this.press(axis, sign);
    });
    button.addEventListener("pointerleave", () => this.letGo());
    button.addEventListener("contextmenu", (event) => event.preventDefault());
    button.addEventListener("keydown", (event) => {
      if (event.key !== " " && event.key !== "Enter") return;
      event.preventDefault();
      if (!event.repeat) this.press(axis, sign);
    });
    button.addEventListener("keyup", () => this.letGo());
    button.addEventListener("blur", () => this.letGo());
  }
}
