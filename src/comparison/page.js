"use strict";
// Draws the figures of a comparison with uPlot, from the JSON beside this script.
(() => {
  const { muscles } = JSON.parse(document.getElementById("data").textContent);
  const FONT = "12px system-ui, sans-serif";
  const HEIGHT = 300;
  const all = []; // every plot, with how to size it

  const color = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  const digits = (value, count) => String(Number(value.toPrecision(count))).replace("-", "−");
  const axis = (label, size) => ({
    label, size, font: FONT, labelFont: FONT, labelSize: 18, labelGap: 0, gap: 3, stroke: () => color("ink"),
    grid: { stroke: () => color("grid"), width: 1 }, ticks: { stroke: () => color("line"), width: 1, size: 5 },
    values: (_, ticks) => ticks.map((tick) => digits(tick, 8)),
  });
  // From blue for the first to red for the last: in order, and as apart as so many can be.
  const shade = (k, count) => `hsl(${225 - (215 * k) / Math.max(count - 1, 1)} 75% 45%)`;

  // A layer is { x, y, color, dots | hollow | line }. uPlot has one column of x for all: rows of all layers in order.
  function draw(place, labels, layers) {
    const rows = layers.flatMap(({ x, y }, k) => x.map((value, i) => [value, y[i], k])).filter(([x]) => Number.isFinite(x));
    rows.sort((a, b) => a[0] - b[0] || a[2] - b[2]);
    const data = [rows.map(([x]) => x), ...layers.map((_, k) => rows.map(([, y, of]) => (of === k ? y : undefined)))];
    const series = layers.map(({ color: stroke, dots, hollow, line }) => ({
      stroke, width: line ? 1.5 : 0, spanGaps: true, paths: line ? undefined : () => null,
      points: { show: Boolean(dots || hollow), size: 6, width: 1.4, stroke, fill: hollow ? "transparent" : stroke },
    }));
    const width = () => place.clientWidth;
    const u = new uPlot({
      width: width(), height: HEIGHT, legend: { show: false }, scales: { x: { time: false } },
      cursor: { drag: { x: true, y: true, uni: 20, dist: 8 } }, series: [{}, ...series],
      axes: [axis(labels[0], 38), axis(labels[1], 66)],
    }, data, place);
    all.push({ u, fit: () => u.setSize({ width: width(), height: HEIGHT }) });
  }

  function legend(figure, names) {
    const list = figure.querySelector(".swatches");
    list.replaceChildren(...names.map(([text, fill]) => {
      const item = document.createElement("li");
      const dot = document.createElement("i");
      dot.style.background = fill;
      item.append(dot, text);
      return item;
    }));
  }

  const pick = (values, of) => of.map((k) => values[k]);
  const places = (count, wanted) => [...Array(count).keys()].filter(wanted);
  const sorted = (x, of) => [...of].sort((a, b) => x[a] - x[b]);

  // Dots of a class, one layer per branch of the hysteresis.
  function branches(muscle, of, x, y, stroke, joined) {
    const split = [of.filter((k) => muscle.branch[k] !== 1), of.filter((k) => muscle.branch[k] === 1)];
    return split.flatMap((members, k) => {
      const at = sorted(x, members);
      if (!at.length) return [];
      const layer = { x: pick(x, at), y: pick(y, at), color: stroke };
      return [{ ...layer, dots: k === 0, hollow: k === 1, line: joined }];
    });
  }

  const figures = {
    isotonic(muscle) {
      if (!muscle.isotonic) return null;
      const { loads, load_of, pressure, contraction } = muscle;
      const layers = loads.flatMap((_, load) => branches(muscle, places(pressure.length, (k) => load_of[k] === load),
        pressure, contraction, shade(load, loads.length), true));
      const names = loads.map((load, k) => [`${digits(load, 3)} N`, shade(k, loads.length)]);
      return { labels: ["gauge pressure [bar]", "contraction [mm]"], layers, names };
    },
    isobaric(muscle, model) {
      const { pressures, pressure_of, contraction, force } = muscle;
      const layers = pressures.flatMap((_, p) => {
        const members = places(force.length, (k) => pressure_of[k] === p);
        const at = sorted(contraction, members);
        const line = { x: pick(contraction, at), y: pick(model.modelled, at), color: shade(p, pressures.length), line: true };
        return [line, ...branches(muscle, members, contraction, force, shade(p, pressures.length), false)];
      });
      const names = pressures.map((p, k) => [`${digits(p, 3)} bar`, shade(k, pressures.length)]);
      return { labels: ["contraction [mm]", "force [N]"], layers, names };
    },
    isometric(muscle, model) {
      const { lengths } = muscle;
      const layers = lengths.flatMap((_, k) => {
        const of = (pairs, kind) => ({ x: pairs.map(([x]) => x), y: pairs.map(([, y]) => y), color: shade(k, lengths.length), ...kind });
        return [of(model.isometric[k], { line: true }), of(muscle.isometric[k][0], { dots: true }), of(muscle.isometric[k][1], { hollow: true })]
          .filter(({ x }) => x.length);
      });
      const names = lengths.map((length, k) => [`${digits(length, 3)} mm`, shade(k, lengths.length)]);
      return lengths.length ? { labels: ["gauge pressure [bar]", "force [N]"], layers, names } : null;
    },
    loads(muscle, model) {
      if (!muscle.isotonic) return null;
      const { loads, load_of, pressure, force } = muscle;
      const layers = loads.flatMap((_, load) => {
        const at = sorted(pressure, places(force.length, (k) => load_of[k] === load));
        const of = (y, kind) => ({ x: pick(pressure, at), y: pick(y, at), color: shade(load, loads.length), ...kind });
        return [of(model.modelled, { line: true }), of(force, { dots: true })];
      });
      const names = loads.map((load, k) => [`${digits(load, 3)} N`, shade(k, loads.length)]);
      return { labels: ["gauge pressure [bar]", "force [N]"], layers, names };
    },
    contours(muscle, model) {
      const { contours } = model;
      const { force, contraction, pressure } = muscle;
      const nearest = (f) => contours.reduce((best, c, k) => (Math.abs(c.force - f) < Math.abs(contours[best].force - f) ? k : best), 0);
      const layers = contours.flatMap(({ line }, k) => {
        const at = places(force.length, (i) => nearest(force[i]) === k);
        const stroke = shade(k, contours.length);
        const there = line.filter(([, y]) => y != null);
        return [{ x: there.map(([x]) => x), y: there.map(([, y]) => y), color: stroke, line: true },
          { x: pick(contraction, at), y: pick(pressure, at), color: stroke, dots: true }];
      });
      const names = contours.map(({ force: f }, k) => [`${digits(f, 3)} N`, shade(k, contours.length)]);
      return { labels: ["contraction [mm]", "gauge pressure [bar]"], layers, names };
    },
    residual(muscle, model) {
      const { pressure, force } = muscle;
      const left = force.map((f, k) => f - model.modelled[k]);
      const layers = branches(muscle, places(force.length, () => true), pressure, left, color("extended"), false);
      return { labels: ["gauge pressure [bar]", "residual [N]"], layers, names: [] };
    },
  };

  function drawMuscle(section) {
    const muscle = muscles[Number(section.dataset.muscle)];
    const model = muscle.models[Number(section.querySelector("[data-choice=model]").value)];
    for (const figure of section.querySelectorAll("[data-figure]")) {
      const place = figure.querySelector(".plot");
      for (const old of all.filter((plot) => place.contains(plot.u.root))) { old.u.destroy(); all.splice(all.indexOf(old), 1); }
      const what = figures[figure.dataset.figure](muscle, model);
      figure.hidden = !what;
      if (!what) continue;
      draw(place, what.labels, what.layers);
      legend(figure, what.names);
    }
  }

  for (const section of document.querySelectorAll("[data-muscle]")) {
    section.querySelector("[data-choice=model]").onchange = () => drawMuscle(section);
    drawMuscle(section);
  }
  const fit = () => all.forEach((plot) => plot.fit());
  new ResizeObserver(fit).observe(document.querySelector("main"));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => document.querySelectorAll("[data-muscle]").forEach(drawMuscle));
  addEventListener("beforeprint", fit);
  addEventListener("afterprint", fit);
})();
