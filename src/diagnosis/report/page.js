"use strict";
// Draws the plots of the report with uPlot, from the JSON beside this script.
(() => {
  const { axes, recordings } = JSON.parse(document.getElementById("data").textContent);
  const FONT = "12px system-ui, sans-serif";
  const PRINT_WIDTH = 680; // CSS pixels between the margins of A4
  const MEANS = 24; // classes whose means are joined by lines
  const all = []; // every plot, with how to size it

  // Colours live in the style sheet; plots ask for them whenever they draw, so that they follow the scheme and print.
  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const digits = (value, count) => String(Number(value.toPrecision(count))).replace("-", "−");
  const number = (value, unit) => (value == null ? "–" : `${digits(value, 5)} ${unit}`);

  const axis = (label, more) => ({
    label, font: FONT, labelFont: FONT, labelSize: 18, labelGap: 0, gap: 3, stroke: () => color("ink"),
    grid: { stroke: () => color("grid"), width: 1 }, ticks: { stroke: () => color("line"), width: 1, size: 5 },
    values: (_, ticks) => ticks.map((tick) => digits(tick, 8)), ...more,
  });
  const across = (label) => axis(label, { size: label ? 37 : 24, space: 46 });
  const up = (label) => axis(label, { size: 66, space: 22 });
  const curve = (label, name, unit, more) => ({
    label, name, stroke: () => color(name), width: 1.5, points: { size: 4 }, value: (_, v) => number(v, unit), ...more,
  });

  // A rectangle in the coordinates of the data, cut to the plot.
  function shade(u, [x0, x1], [y0, y1], fill) {
    const { left, top, width, height } = u.bbox;
    const within = (value, low, size) => Math.min(Math.max(value, low), low + size);
    const right = (x) => within(Number.isFinite(x) ? u.valToPos(x, "x", true) : left + (x > 0) * width, left, width);
    const down = (y) => within(Number.isFinite(y) ? u.valToPos(y, "y", true) : top + (y < 0) * height, top, height);
    u.ctx.fillStyle = fill;
    u.ctx.fillRect(right(x0), down(y1), right(x1) - right(x0), down(y0) - down(y1));
  }
  const band = (u, noise) => {
    if (noise) shade(u, [-Infinity, Infinity], [-2 * noise, 2 * noise], color("held-out"));
  };

  function add(place, height, options, data) {
    const width = () => (document.documentElement.classList.contains("printing")
      ? Math.min(PRINT_WIDTH, place.closest(".grid") ? PRINT_WIDTH / 2 - 12 : PRINT_WIDTH) : place.clientWidth);
    const legend = { markers: { width: 0, fill: (u, k) => u.series[k].name && `var(--${u.series[k].name})` } };
    const u = new uPlot({ width: width(), height, legend, ...options }, data, place);
    byTouch(u);
    const plot = { u, fit: () => u.setSize({ width: width(), height }), place };
    all.push(plot);
    return plot;
  }

  // uPlot knows the mouse only: one finger across selects, one finger up or down still scrolls the page.
  function byTouch(u) {
    const as = { pointerdown: "mousedown", pointermove: "mousemove", pointerup: "mouseup", pointercancel: "mouseup" };
    let start = null;
    for (const type of Object.keys(as)) {
      u.over.addEventListener(type, (event) => {
        if (event.pointerType !== "touch") return;
        if (type === "pointerdown") start = event;
        const at = type === "pointercancel" && start ? start : event; // the page scrolls: nothing is selected
        const target = as[type] === "mouseup" ? document : u.over;
        const mouse = new MouseEvent(as[type], { clientX: at.clientX, clientY: at.clientY, bubbles: true });
        Object.defineProperty(mouse, "movementX", { value: 1 }); // uPlot passes over moves by nothing
        target.dispatchEvent(mouse);
      });
    }
  }

  // Signals over time: all plots of a recording show the same stretch.
  function drawRecording(section) {
    const index = Number(section.dataset.recording);
    const recording = recordings[index];
    const from = recording.held_out_from;
    const times = recording.signals.map((signal) => signal.time);
    const whole = [Math.min(...times.map((t) => t[0])), Math.max(...times.map((t) => t[t.length - 1]))];
    const output = section.querySelector("output");
    const plots = [];
    let shown = whole;

    function show([low, high]) {
      const size = Math.min(Math.max(high - low, 1e-3 * (whole[1] - whole[0])), whole[1] - whole[0]);
      const start = Math.min(Math.max(low, whole[0]), whole[1] - size);
      shown = [start, start + size];
      output.value = `${shown[0].toFixed(2)} to ${shown[1].toFixed(2)} s`;
      for (const { u } of plots) u.setScale("x", { min: shown[0], max: shown[1] });
    }

    // Asked for a stretch by a drag or double-click in one plot: shows it in all.
    const follow = (u, key) => {
      const { min, max } = u.scales[key];
      if (key === "x" && plots.length && (min !== shown[0] || max !== shown[1])) show([min, max]);
    };
    const shared = (more) => ({
      scales: { x: { time: false }, ...more.scales },
      cursor: { sync: { key: `recording ${index}`, scales: ["x", null] }, drag: { x: true, y: false, dist: 8 } },
      series: [{ label: "time", value: (_, v) => number(v, "s") }, ...more.series],
      axes: more.axes,
      hooks: { setScale: [follow], drawClear: [more.background] },
    });
    const heldOut = (u) => {
      if (from != null) shade(u, [from, Infinity], [-Infinity, Infinity], color("held-out"));
    };

    for (const place of section.querySelectorAll(".plot")) {
      const { label, unit, noise, time, measured, nominal, extended } = recording.signals[place.dataset.signal];
      if (place.dataset.plot === "signal") {
        const series = [curve("measured", "measured", unit, { width: 2 }),
          curve("nominal", "nominal", unit, { dash: [7, 4] }), curve("extended", "extended", unit)];
        const options = shared({ series, axes: [across(), up(`${label} [${unit}]`)], background: heldOut });
        plots.push(add(place, 220, options, [time, measured, nominal, extended]));
      } else {
        const minus = (simulated) => measured.map((m, k) => (m == null || simulated[k] == null ? null : m - simulated[k]));
        const series = [curve("measured − nominal", "nominal", unit), curve("measured − extended", "extended", unit)];
        const background = (u) => { heldOut(u); band(u, noise); };
        const options = shared({ series, axes: [across("time [s]"), up(`residual [${unit}]`)], background });
        plots.push(add(place, 150, options, [time, minus(nominal), minus(extended)]));
      }
    }
    const move = (share, scale = 1) => () => {
      const [size, middle] = [shown[1] - shown[0], (shown[0] + shown[1]) / 2 + share * (shown[1] - shown[0])];
      show([middle - scale * size / 2, middle + scale * size / 2]);
    };
    const tools = { earlier: move(-0.4), later: move(0.4), in: move(0, 0.5), out: move(0, 2), whole: () => show(whole) };
    for (const button of section.querySelectorAll("[data-tool]")) button.onclick = tools[button.dataset.tool];
    for (const { u } of plots) u.over.addEventListener("mousedown", (event) => pan(event, u, () => shown, show), true);
    show(whole);
  }

  // Shift and drag moves the stretch that is shown.
  function pan(event, u, shown, show) {
    if (!event.shiftKey) return;
    event.stopImmediatePropagation();
    const [low, high] = shown();
    const perPixel = (high - low) / u.over.clientWidth;
    const move = (now) => show([low - (now.clientX - event.clientX) * perPixel, high - (now.clientX - event.clientX) * perPixel]);
    document.addEventListener("mousemove", move);
    document.addEventListener("mouseup", () => document.removeEventListener("mousemove", move), { once: true });
  }

  // Residuals of a link over a variable: samples as dots, means of classes with equally many samples as lines.
  function drawDots(place) {
    const figure = place.closest("figure");
    const choice = (name) => figure.querySelector(`[data-choice=${name}]`);
    const link = Number(place.dataset.link);
    let plot = null;

    function cloud() {
      const chosen = choice("recording")?.value;
      const dots = recordings.filter((_, k) => !chosen || Number(chosen) === k).map((recording) => recording.dots);
      const { cause } = place.dataset;
      const rows = dots.flatMap(({ variables, nominal, extended, causes }) => {
        const before = cause == null ? nominal[link] : causes[cause];
        return variables[choice("variable").value].map((x, k) => [x, before[k], extended[link][k]]);
      });
      const known = rows.filter(([x, before, after]) => x != null && (before != null || after != null));
      known.sort((a, b) => a[0] - b[0]);
      const columns = [0, 1, 2].map((k) => known.map((row) => row[k]));
      return [...columns, means(columns[1]), means(columns[2])];
    }

    function draw(narrow) {
      if (plot) { plot.u.destroy(); all.splice(all.indexOf(plot), 1); }
      const { label, unit } = axes.variables[choice("variable").value];
      const own = axes.links[link];
      const many = (name) => ({
        paths: () => null, points: { show: true, size: 3, width: 0, fill: () => `${color(name)}59`, stroke: "transparent" },
      });
      const line = { width: 3, spanGaps: true, points: { show: false } };
      const before = place.dataset.before;
      const data = cloud();
      plot = add(place, 270, {
        scales: { x: { time: false } },
        cursor: { drag: { x: true, y: true, uni: 20, dist: 8 } },
        series: [{ label, value: (_, v) => number(v, unit) },
          curve(before, "nominal", own.unit, many("nominal")), curve("extended", "extended", own.unit, many("extended")),
          curve("its mean", "nominal", own.unit, { ...line, dash: [9, 4] }), curve("its mean", "extended", own.unit, line)],
        axes: [across(`${label} [${unit}]`), up(`residual [${own.unit}]`)],
        hooks: {
          drawClear: [(u) => band(u, own.noise)],
          setSelect: [() => { choice("whole").disabled = false; }],
        },
      }, data);
      if (narrow) {
        const x = central(data[0], 0.02);
        const y = central([...data[1], ...data[2]], 0.005);
        if (x) plot.u.setScale("x", x);
        if (y) plot.u.setScale("y", y);
        choice("whole").disabled = !x && !y;
      }
    }
    for (const select of figure.querySelectorAll("select")) select.onchange = () => draw(true);
    choice("whole").onclick = () => { draw(false); choice("whole").disabled = true; };
    draw(true);
  }

  // Range without the few values that would squeeze the rest; nothing where there are none.
  function central(values, tail) {
    const sorted = values.filter((value) => value != null).sort((a, b) => a - b);
    const at = (share) => sorted[Math.round(share * (sorted.length - 1))];
    const [low, high] = [at(tail), at(1 - tail)];
    const room = 0.15 * (high - low);
    if (!(at(1) - at(0) > 1.6 * (high - low)) || room === 0) return null;
    return { min: Math.max(at(0), low - room), max: Math.min(at(1), high + room) };
  }

  // Means of classes with equally many samples, each at its middle sample; null elsewhere.
  function means(values) {
    const at = values.map((value, k) => (value == null ? -1 : k)).filter((k) => k >= 0);
    const result = values.map(() => null);
    const size = Math.max(1, Math.ceil(at.length / MEANS));
    for (let start = 0; start < at.length; start += size) {
      const members = at.slice(start, start + size);
      result[members[members.length >> 1]] = members.reduce((sum, k) => sum + values[k], 0) / members.length;
    }
    return result;
  }

  for (const section of document.querySelectorAll("[data-recording]")) drawRecording(section);
  for (const place of document.querySelectorAll("[data-plot=dots]")) drawDots(place);

  const fit = () => all.forEach((plot) => plot.fit());
  new ResizeObserver(fit).observe(document.querySelector("main"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => all.forEach(({ u }) => u.redraw(false)));
  const printing = (on) => { document.documentElement.classList.toggle("printing", on); fit(); };
  addEventListener("beforeprint", () => printing(true));
  addEventListener("afterprint", () => printing(false));
})();
