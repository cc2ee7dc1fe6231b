"use strict";
// The machine's settings: found by path, changed in its draft, compared with the settings in force, applied, stored.

// Settings whose values are read for one search at most.
const MOST_SHOWN = 40;
const AXIS_LETTERS = { 0: "x", 1: "y", 2: "z" };
// A path as people write it: x/feedback/law.
const shortPath = (path) => path.replace(/^\/axes\/([012])/, (_, axis) => AXIS_LETTERS[axis]).replace(/^\//, "");

class Draft {
  // `ask` asks the machine, `say` tells the user.
  constructor(ask, say) {
    Object.assign(this, { ask, say });
    this.paths = [];
    this.search = 0;
    $("m-find").addEventListener("input", () => this.show());
    $("m-find").addEventListener("focus", () => this.load());
    $("m-read").addEventListener("click", () => this.load(true));
    $("m-apply").addEventListener("click", () => this.apply());
    $("m-revert").addEventListener("click", () => this.tryTo(async () => {
      await this.ask("revert");
      this.say("the draft equals the settings in force");
      await this.reload();
    }));
    $("m-diff").addEventListener("click", () => this.tryTo(() => this.compare()));
    $("m-store").addEventListener("click", () => this.tryTo(async () => {
      const text = $("m-origin").value.trim() || `the page, ${new Date().toISOString().slice(0, 10)}`;
      await this.ask({ store: { text } });
      this.say("stored for the next start");
    }));
  }

  clear() {
    this.paths = [];
    this.search += 1;
    $("m-settings").replaceChildren();
    $("m-differences").replaceChildren();
    $("m-found").textContent = "";
  }

  async tryTo(act) {
    try {
      await act();
    } catch (error) {
      this.say(error.message, true);
    }
  }

  // All pages of paths.
  async pages(name) {
    const paths = [];
    for (let cursor = 0; cursor !== null; ) {
      const page = await this.ask({ [name]: { cursor } });
      paths.push(...page.paths);
      cursor = page.next > cursor ? page.next : null;
    }
    return paths;
  }

  load(again = false) {
    if (this.paths.length && !again) return this.show();
    return this.tryTo(async () => {
      $("m-found").textContent = "reading the list …";
      this.paths = await this.pages("list");
      await this.show();
      await this.compare();
    });
  }

  reload() {
    return this.load(true);
  }

  // Shows the settings that have all of the words in their path.
  async show() {
    this.search += 1;
    const search = this.search;
    const words = $("m-find").value.toLowerCase().split(/[\s/]+/).filter(Boolean);
    const parts = (path) => shortPath(path).split("/");
    const fits = (path) => words.every((word) => (word.length === 1 ? parts(path)[0] === word : shortPath(path).includes(word)));
    const found = this.paths.filter(fits);
    const shown = found.slice(0, MOST_SHOWN);
    $("m-found").textContent = this.paths.length ? `${found.length} of ${this.paths.length} settings${found.length > shown.length ? `; the first ${shown.length} are shown, say more to find fewer` : ""}` : "";
    const rows = [];
    await this.tryTo(async () => {
      for (const path of shown) {
        if (document.hidden || search !== this.search) return;
        rows.push(this.row(await this.ask({ get: { path } })));
      }
    });
    if (search === this.search) $("m-settings").replaceChildren(...rows);
  }

  row({ path, value, kind, unit, range, names, meaning }) {
    const row = document.createElement("div");
    row.className = "setting";
    row.dataset.path = path;
    const id = `s${Draft.count++}`;
    row.innerHTML = `<label for="${id}"></label><span class="value"></span><span class="unit"></span><p class="meaning"></p><span class="refused" role="status"></span>`;
    const [label, place, units, meant, refused] = row.children;
    label.textContent = shortPath(path);
    units.textContent = unit;
    const bounds = range ? ` ${range.map((bound) => Number(bound.toPrecision(4))).join(" to ")}${unit ? ` ${unit}` : ""}.` : "";
    meant.textContent = `${meaning}${bounds}`;
    const input = document.createElement(names || kind === "flag" ? "select" : "input");
    input.id = id;
    const said = typeof value === "number" ? String(Number(value.toPrecision(7))) : typeof value === "string" ? value : JSON.stringify(value);
    if (input instanceof HTMLSelectElement) input.append(...(names ?? ["true", "false"]).map((name) => new Option(name, name, false, name === said)));
    else Object.assign(input, { type: "text", value: said, autocomplete: "off", spellcheck: false, inputMode: kind === "number" ? "decimal" : "text" });
    input.addEventListener("change", () => this.set(path, kind, input.value, refused, said, input));
    place.append(input);
    return row;
  }

  async set(path, kind, text, refused, before, input) {
    refused.textContent = "";
    try {
      await this.ask({ set: { path, value: valueOf(kind, text) } });
      this.say(`${shortPath(path)} = ${text} in the draft; Apply puts it in force`);
      await this.compare();
    } catch (error) {
      refused.textContent = error.message;
      input.value = before;
    }
  }

  // Shows where the draft differs from the settings in force.
  async compare() {
    const rows = [];
    for (const path of await this.pages("edited")) {
      // What acts may lack the part that the draft has, or the other way.
      const valueAt = (request) => this.ask(request).then(({ value }) => JSON.stringify(value), () => "–");
      const row = document.createElement("tr");
      row.insertCell().textContent = shortPath(path);
      row.insertCell().textContent = await valueAt({ "get-in-force": { path } });
      row.insertCell().textContent = await valueAt({ get: { path } });
      rows.push(row);
    }
    $("m-differences").replaceChildren(...rows);
    $("m-difference").textContent = rows.length ? `${rows.length} edited and not in force` : "the same as the settings in force";
  }

  apply() {
    return this.tryTo(async () => {
      const { axes, restart_needed } = await this.ask("apply");
      const where = axes.length ? `acting now on ${axes.join(", ")}` : "no axis changed";
      this.say(restart_needed ? "the control rate or an encoder changed: nothing acts yet; Disable, Store and restart the board" : where);
      await this.compare();
    });
  }
}
Draft.count = 0;

// What was typed, as a value of this kind: a number with a comma is refused by the machine's words, not guessed.
function valueOf(kind, text) {
  try {
    return JSON.parse(text);
  } catch {
    return text;
  }
}
