// Draws a figure as SVG in the page, and lets the reader zoom, read values and save the drawing.
// `chart(box, figure)` draws the description `figure` (drawing.rs) into the element `box`. Positions on an axis are
// "places": the value, or its decimal logarithm on a logarithmic axis.
const chart = (() => {
  const make = (name, attributes = {}, text = "") => {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) if (value !== null) element.setAttribute(key, value);
    element.textContent = text;
    return element;
  };
  const px = (length) => String(Math.round(length * 10) / 10);
  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  // Axes

  const place = (axis, value) => (value === null ? NaN : axis.log ? (value > 0 ? Math.log10(value) : NaN) : value);
  const value = (axis, at) => (axis.log ? 10 ** at : at);
  const minus = (text) => text.replace("-", "\u2212");
  const superscript = (number) => [...String(number)].map((c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("");

  const power = (digit, decade) => {
    if (decade >= -3 && decade <= 4) return (digit * 10 ** decade).toFixed(Math.max(0, -decade));
    return `${digit === 1 ? "" : `${digit}·`}10${superscript(decade)}`;
  };

  const evenTicks = (low, high, count) => {
    const rough = (high - low) / count;
    const decade = Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].find((s) => s * 10 ** decade >= rough * (1 - 1e-9)) * 10 ** decade;
    const largest = Math.max(Math.abs(low), Math.abs(high));
    const exponent = step < 1e-4 || largest >= 1e6 ? Math.floor(Math.log10(largest)) : 0;
    const decimals = clamp(exponent - Math.floor(Math.log10(step) + 1e-9), 0, 20);
    const label = (at) =>
      at === 0 ? "0" : minus((at / 10 ** exponent).toFixed(decimals)) + (exponent ? `·10${superscript(exponent)}` : "");
    const ticks = [];
    for (let k = Math.ceil(low / step - 1e-6); k <= high / step + 1e-6; k++) ticks.push({ at: k * step, label: label(k * step) });
    return ticks;
  };

  const decadeTicks = (low, high, count) => {
    const span = high - low;
    if (span < 0.3) return evenTicks(10 ** low, 10 ** high, count).map(({ at, label }) => ({ at: Math.log10(at), label }));
    // Below about two decades, powers of ten alone would leave an axis with one label or none.
    const labelled = span < 1 ? [1, 2, 3, 4, 5, 6, 7, 8, 9] : span < 2.2 ? [1, 2, 5] : [1];
    const every = Math.max(1, Math.ceil(span / count));
    const ticks = [];
    for (let decade = Math.floor(low); decade <= high; decade++) {
      for (let digit = 1; digit < 10; digit++) {
        const at = decade + Math.log10(digit);
        const isLabelled = labelled.includes(digit) && (span < 2.2 || decade % every === 0);
        if (at < low - 1e-9 || at > high + 1e-9 || !(isLabelled || digit === 1 || span < 4.5)) continue;
        ticks.push({ at, label: isLabelled ? power(digit, decade) : null });
      }
    }
    return ticks;
  };

  const ticks = (axis, [low, high], length, spacing) => {
    if (axis.ticks.length) return axis.ticks.map(([at, label]) => ({ at, label })).filter(({ at }) => at >= low && at <= high);
    return (axis.log ? decadeTicks : evenTicks)(low, high, Math.max(2, Math.floor(length / spacing)));
  };

  // Data in places, once for each figure

  const placed = (figure) => figure.curves.map((curve) => {
    const on = (axis, values) => values.map((v) => place(axis, v));
    return { x: on(figure.x, curve.x), y: on(figure.y, curve.y) };
  });

  const extent = (axis, lists) => {
    if (axis.range) return axis.range.map((v) => place(axis, v));
    let [low, high] = [Infinity, -Infinity];
    for (const list of lists) for (const at of list) if (Number.isFinite(at)) [low, high] = [Math.min(low, at), Math.max(high, at)];
    if (low > high) return [0, 1];
    const pad = high > low ? axis.margin * (high - low) : 0.5 * Math.max(1, Math.abs(high));
    return [low - pad, high + pad];
  };

  // Drawing

  const LEFT = 30, RIGHT = 12, TOP = 8, BOTTOM = 44, LETTER = 6.3;

  // Returns the rectangle for curves in a drawing of this size, and the view with equal units where they are asked for.
  const layOut = (figure, view, [width, height]) => {
    const y = ticks(figure.y, view.y, height - TOP - BOTTOM, 45);
    const letters = y.map(({ label }) => (label ?? "").length);
    const left = Math.min(LEFT + LETTER * Math.max(2, ...letters), width / 2);
    const frame = { left, right: width - RIGHT, top: TOP, bottom: height - BOTTOM };
    const size = { x: Math.max(1, frame.right - left), y: Math.max(1, frame.bottom - TOP) };
    if (figure.equal) {
      const unit = Math.max(...["x", "y"].map((a) => (view[a][1] - view[a][0]) / size[a]));
      const widen = (a) => {
        const middle = (view[a][0] + view[a][1]) / 2;
        return [middle - unit * size[a] / 2, middle + unit * size[a] / 2];
      };
      view = { x: widen("x"), y: widen("y") };
    }
    return {
      frame, size, view,
      toX: (at) => left + (at - view.x[0]) / (view.x[1] - view.x[0]) * size.x,
      toY: (at) => TOP + (view.y[1] - at) / (view.y[1] - view.y[0]) * size.y,
    };
  };

  const line = ({ toX, toY }, xs, ys) => {
    let path = "", down = false;
    for (let i = 0; i < xs.length; i++) {
      const finite = Number.isFinite(xs[i]) && Number.isFinite(ys[i]);
      if (finite) path += `${down ? "L" : "M"}${px(toX(xs[i]))} ${px(toY(ys[i]))}`;
      down = finite;
    }
    return path;
  };

  const marks = ({ toX, toY }, xs, ys, mark) =>
    xs.map((x, i) => (Number.isFinite(x + ys[i]) ? `M${px(toX(x))} ${px(toY(ys[i]))}${mark}` : "")).join("");

  const drawCurve = (layout, curve, data) => {
    const { shape } = curve;
    const group = make("g", { class: "curve", style: `color:${curve.colour[0]};color:light-dark(${curve.colour})` });
    if (shape.kind === "line") group.append(make("path", { class: "stroke", "stroke-dasharray": shape.dash, d: line(layout, data.x, data.y) }));
    if (shape.mark) group.append(make("path", { class: "mark", d: marks(layout, data.x, data.y, shape.mark) }));
    return group;
  };

  const drawAxes = (figure, layout) => {
    const { frame, size, view, toX, toY } = layout;
    const group = make("g");
    const drawText = (x, y, anchor, text, name = "tick") => {
      group.append(make("text", { class: name, x: px(x), y: px(y), "text-anchor": anchor }, text));
    };
    const isZero = (axis, at) => axis.zero && !axis.log && Math.abs(at) < 1e-9;
    for (const { at, label } of ticks(figure.x, view.x, size.x, 64)) {
      const zero = isZero(figure.x, at), x = px(toX(at));
      if (zero || (figure.x.grid && label !== null)) group.append(make("path", { class: zero ? "rule" : "grid", d: `M${x} ${frame.top}V${frame.bottom}` }));
      group.append(make("path", { class: "rule", d: `M${x} ${frame.bottom}v${label === null ? 2 : 4}` }));
      if (label === null) continue;
      // A label at the very end of the axis ends with the drawing: beyond it, it would be cut.
      const edge = frame.right + RIGHT;
      const isCut = toX(at) + 0.7 * LETTER * label.length > edge;
      drawText(isCut ? edge : toX(at), frame.bottom + 17, isCut ? "end" : "middle", label);
    }
    for (const { at, label } of ticks(figure.y, view.y, size.y, 45)) {
      const zero = isZero(figure.y, at);
      if (zero || (figure.y.grid && label !== null)) group.append(make("path", { class: zero ? "rule" : "grid", d: `M${px(frame.left)} ${px(toY(at))}H${frame.right}` }));
      if (label !== null) drawText(frame.left - 7, toY(at) + 4, "end", label);
    }
    group.append(make("path", { class: "rule", d: `M${px(frame.left)} ${frame.top}V${frame.bottom}H${frame.right}` }));
    drawText((frame.left + frame.right) / 2, frame.bottom + 37, "middle", figure.x.label, "x-label");
    const y = make("text", { class: "y-label", transform: `translate(14 ${px((frame.top + frame.bottom) / 2)}) rotate(-90)`, "text-anchor": "middle" }, figure.y.label);
    group.append(y);
    return group;
  };

  const drawCircles = (figure, { toX, toY }) => {
    const group = make("g");
    for (const { radius, nominal } of figure.circles) {
      group.append(make("circle", { class: nominal ? "nominal" : "division", cx: px(toX(0)), cy: px(toY(0)), r: px(toX(radius) - toX(0)) }));
    }
    for (const { x, y, dy, anchor, text } of figure.texts) {
      group.append(make("text", { class: "tick", x: px(toX(x)), y: px(toY(y) + dy), "text-anchor": anchor }, text));
    }
    return group;
  };

  let clips = 0;
  const drawAll = (figure, data, layout, [width, height], isShown) => {
    const { frame, size } = layout;
    const clip = `clip-${clips++}`;
    const svg = make("svg", { class: "chart", xmlns: "http://www.w3.org/2000/svg", width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": figure.caption });
    const clipPath = make("clipPath", { id: clip });
    clipPath.append(make("rect", { x: px(frame.left), y: frame.top, width: px(size.x), height: px(size.y) }));
    const inside = make("g", { "clip-path": `url(#${clip})` });
    inside.append(drawCircles(figure, layout));
    figure.curves.forEach((curve, i) => { if (isShown(i)) inside.append(drawCurve(layout, curve, data[i])); });
    svg.append(clipPath, drawAxes(figure, layout), inside);
    return svg;
  };

  // Reading values

  const short = (number) => minus(String(Number(number.toPrecision(5))));
  const quantity = (label, number) => {
    const [, name, unit] = /^(.*?)(?:\s*\(([^()]*)\)|, ([^,]*))?$/.exec(label) ?? [];
    return `${name} ${short(number)}${unit ? ` ${unit}` : ""}`;
  };

  const reading = (figure, curve, i) => {
    const { shape } = curve;
    if (shape.deviation) {
      const angle = (Math.atan2(curve.y[i], curve.x[i]) * 180 / Math.PI + 360) % 360;
      return `${short(shape.deviation[i])} µm at ${minus(angle.toFixed(1))}°`;
    }
    return `${quantity(figure.x.label, curve.x[i])}, ${quantity(figure.y.label, curve.y[i])}`;
  };

  // The sample nearest to a point of the drawing, px, among curves that are shown.
  const nearest = (figure, data, { toX, toY }, isShown, x, y) => {
    let best = null, least = 40 ** 2;
    figure.curves.forEach((curve, c) => {
      if (!isShown(c)) return;
      const { x: xs, y: ys } = data[c];
      for (let i = 0; i < xs.length; i++) {
        const distance = (toX(xs[i]) - x) ** 2 + (toY(ys[i]) - y) ** 2;
        if (distance < least) [best, least] = [{ curve, i, x: toX(xs[i]), y: toY(ys[i]) }, distance];
      }
    });
    return best;
  };

  // Saving

  const STYLES = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-dasharray", "stroke-linejoin", "font-family", "font-size", "color"];

  const addLegend = (svg, figure, isShown, width) => {
    let x = 16, y = 16;
    const group = make("g");
    figure.curves.forEach((curve, i) => {
      if (!isShown(i)) return;
      const length = 33 + LETTER * 1.05 * curve.name.length;
      if (x > 16 && x + length > width - 8) [x, y] = [16, y + 18];
      const sample = make("g", { class: "curve", style: `color:${curve.colour[0]}` });
      const { kind, mark, dash } = curve.shape;
      if (kind === "line") sample.append(make("path", { class: "stroke", "stroke-dasharray": dash, d: `M${x} ${y}h26` }));
      if (mark) sample.append(make("path", { class: "mark", d: `M${x + 13} ${y}${mark}` }));
      group.append(sample, make("text", { class: "tick", x: x + 33, y: y + 4 }, curve.name));
      x += length + 14;
    });
    svg.append(group);
    return group.childElementCount ? y + 14 : 0;
  };

  const download = (blob, name) => {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  };

  const savePng = (source, [width, height], name) => {
    const image = new Image();
    image.onload = () => {
      const canvas = document.createElement("canvas");
      [canvas.width, canvas.height] = [2 * width, 2 * height];
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => download(blob, name), "image/png");
    };
    image.src = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(source)}`;
  };

  // The chart of one figure

  return (box, figure) => {
    const data = placed(figure);
    const hidden = new Set();
    const isShown = (i) => !hidden.has(i);
    let zoomed = null, layout = null, size = [0, 0];

    const home = () => {
      const shown = data.filter((_, i) => isShown(i));
      return {
        x: extent(figure.x, shown.map((curve) => curve.x)),
        y: extent(figure.y, shown.map((curve) => curve.y)),
      };
    };

    const readout = document.createElement("output");
    readout.className = "readout";
    readout.hidden = true;

    const render = () => {
      layout = layOut(figure, zoomed ?? home(), size);
      box.querySelector("svg.chart")?.remove();
      box.append(drawAll(figure, data, layout, size, isShown));
      readout.hidden = true;
    };

    // Shows places between two corners; a view of next to nothing is refused, since curves have no more samples there.
    const show = (view) => {
      const full = home();
      const tooClose = ["x", "y"].some((a) => Math.abs(view[a][1] - view[a][0]) < 2e-4 * (full[a][1] - full[a][0]));
      if (!tooClose) zoomed = view;
      render();
    };
    const scaled = ([low, high], factor, shift) => {
      const [middle, half] = [(low + high) / 2 + shift * (high - low), factor * (high - low) / 2];
      return [middle - half, middle + half];
    };
    const zoom = (factor) => show({ x: scaled(layout.view.x, factor, 0), y: scaled(layout.view.y, factor, 0) });
    const pan = (x, y) => show({ x: scaled(layout.view.x, 1, x), y: scaled(layout.view.y, 1, y) });
    const reset = () => { zoomed = null; render(); };

    // Images are saved for print: in light colours, with background and legend, as wide as a page's text.
    const save = (format) => {
      const imageSize = figure.equal && figure.circles.length ? [620, 650] : [680, Math.round(clamp(680 * size[1] / size[0], 260, 680))];
      const svg = drawAll(figure, data, layOut(figure, zoomed ?? home(), imageSize), imageSize, isShown);
      const legendHeight = addLegend(svg, figure, isShown, imageSize[0]);
      const height = imageSize[1] + legendHeight;
      const legend = svg.lastElementChild;
      const body = make("g", { transform: `translate(0 ${legendHeight})` });
      body.append(...[...svg.children].filter((child) => child !== legend));
      svg.prepend(make("rect", { width: "100%", height: "100%", fill: "#ffffff" }), body);
      svg.setAttribute("height", height);
      svg.setAttribute("viewBox", `0 0 ${imageSize[0]} ${height}`);
      const root = document.documentElement, theme = root.dataset.theme;
      root.dataset.theme = "light";
      box.append(svg);
      for (const element of svg.querySelectorAll("path, text, circle")) {
        const style = getComputedStyle(element);
        const inlined = STYLES.map((name) => `${name}:${style.getPropertyValue(name)}`).join(";");
        element.setAttribute("style", inlined);
      }
      svg.remove();
      if (theme) root.dataset.theme = theme; else delete root.dataset.theme;
      const source = new XMLSerializer().serializeToString(svg);
      const name = `${box.dataset.figure}.${format}`;
      if (format === "png") savePng(source, [imageSize[0], height], name);
      else download(new Blob([source], { type: "image/svg+xml" }), name);
    };

    const tools = document.createElement("div");
    tools.className = "tools";
    const actions = [
      ["+", "Zoom in", () => zoom(0.6)], ["\u2212", "Zoom out", () => zoom(1 / 0.6)], ["Reset", "Show everything", reset],
      ["SVG", "Save as SVG", () => save("svg")], ["PNG", "Save as PNG", () => save("png")],
    ];
    for (const [text, title, act] of actions) {
      const button = document.createElement("button");
      Object.assign(button, { type: "button", textContent: text, title });
      button.addEventListener("click", act);
      tools.append(button);
    }

    const keys = {
      "+": () => zoom(0.6), "-": () => zoom(1 / 0.6), 0: reset, Escape: reset,
      ArrowLeft: () => pan(-0.1, 0), ArrowRight: () => pan(0.1, 0), ArrowUp: () => pan(0, 0.1), ArrowDown: () => pan(0, -0.1),
    };
    box.tabIndex = 0;
    box.addEventListener("keydown", (event) => {
      if (event.target !== box || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
      keys[event.key]();
      event.preventDefault();
    });

    // Dragging draws a rectangle and zooms into it; a finger scrolls the page instead.
    let start = null;
    const rubber = make("rect", { class: "rubber" });
    const point = (event) => {
      const corner = box.getBoundingClientRect();
      const { frame } = layout;
      return [clamp(event.clientX - corner.left, frame.left, frame.right), clamp(event.clientY - corner.top, frame.top, frame.bottom)];
    };
    const rectangle = (event) => {
      const end = point(event);
      return { x: [start[0], end[0]].sort((a, b) => a - b), y: [start[1], end[1]].sort((a, b) => a - b) };
    };
    box.addEventListener("pointerdown", (event) => {
      if (event.button !== 0 || event.pointerType === "touch" || !event.target.closest("svg.chart")) return;
      start = point(event);
      box.setPointerCapture(event.pointerId);
    });
    box.addEventListener("pointermove", (event) => {
      if (!layout) return;
      if (start) {
        const { x, y } = rectangle(event);
        for (const [key, length] of Object.entries({ x: x[0], y: y[0], width: x[1] - x[0], height: y[1] - y[0] })) rubber.setAttribute(key, length);
        box.querySelector("svg.chart").append(rubber);
        readout.hidden = true;
        return;
      }
      const found = event.target.closest("svg.chart") && nearest(figure, data, layout, isShown, ...point(event));
      readout.hidden = !found;
      if (!found) return;
      readout.textContent = `${found.curve.name}: ${reading(figure, found.curve, found.i)}`;
      readout.style.left = `${clamp(found.x + 10, 0, Math.max(0, size[0] - readout.offsetWidth))}px`;
      readout.style.top = `${Math.max(0, found.y - readout.offsetHeight - 8)}px`;
    });
    box.addEventListener("pointerup", (event) => {
      if (!start) return;
      const { x, y } = rectangle(event);
      start = null;
      rubber.remove();
      if (x[1] - x[0] < 5 && y[1] - y[0] < 5) return;
      const { frame, size: room, view } = layout;
      const back = (from, length, [low, high]) => (at) => low + (at - from) / length * (high - low);
      const [toX, toY] = [back(frame.left, room.x, view.x), back(frame.bottom, -room.y, view.y)];
      // A stripe zooms along one axis.
      show({ x: x[1] - x[0] < 5 ? view.x : x.map(toX), y: y[1] - y[0] < 5 ? view.y : [toY(y[1]), toY(y[0])] });
    });
    box.addEventListener("pointercancel", () => { start = null; rubber.remove(); });
    box.addEventListener("pointerleave", () => { readout.hidden = true; });
    box.addEventListener("dblclick", reset);
    box.replaceChildren(tools, readout);

    return {
      // Draws in a size, px.
      draw: (width, height) => { size = [width, height]; render(); },
      toggle: (i, shown) => { if (shown) hidden.delete(i); else hidden.add(i); if (layout) render(); },
    };
  };
})();
