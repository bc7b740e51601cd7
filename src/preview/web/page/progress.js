// How far the render is: numbers, devices, and the error against time.

const duration = (s) => {
  if (s === null || s === undefined) return "–";
  if (s < 60) return `${s.toFixed(1)} s`;
  if (s < 3600) return `${Math.floor(s / 60)} min ${String(Math.floor(s % 60)).padStart(2, "0")} s`;
  return `${Math.floor(s / 3600)} h ${String(Math.floor((s % 3600) / 60)).padStart(2, "0")} min`;
};
const count = (v) => {
  for (const [size, name] of [[1e12, " T"], [1e9, " G"], [1e6, " M"], [1e3, " k"]]) if (v >= size) return `${(v / size).toPrecision(3)}${name}`;
  return String(Math.round(v));
};
const bytes = (v) => {
  let i = 0;
  for (; v >= 1024 && i < 5; i++) v /= 1024;
  return `${i ? v.toFixed(1) : v} ${["bytes", "KiB", "MiB", "GiB", "TiB", "PiB"][i]}`;
};
// Tiles in a row together.
const runs = (tiles) => {
  const found = [];
  for (const t of [...tiles].sort((a, b) => a - b)) {
    const last = found[found.length - 1];
    if (last && last[1] === t - 1) last[1] = t;
    else found.push([t, t]);
  }
  return found.map(([a, b]) => (a === b ? `${a}` : `${a}–${b}`)).join(", ");
};

class Progress {
  constructor(find) {
    this.find = find;
    this.curve = [];
    this.before = null;
    this.rates = [];
    new ResizeObserver(() => this.plot && this.plot.setSize(this.size())).observe(find("curve-plot"));
  }

  size() {
    return { width: Math.max(200, this.find("curve-plot").clientWidth), height: 210 };
  }

  update(state) {
    const { find } = this;
    const rows = [];
    const viewing = state.stage === "viewing";
    const error = state.error_estimate === undefined || state.error_estimate === null ? "–" : `${short(100 * state.error_estimate, 3)} %`;
    const samples = viewing && state.samples_most !== state.samples ? `${state.samples}–${state.samples_most}` : `${state.samples ?? 0}`;
    rows.push(["samples", samples], ["error", error]);
    const ends = state.tile_ends;
    if (ends) {
      rows.push(["tiles ended", `${ends.ended} of ${ends.tiles}`]);
      rows.push(["worst tile", ends.worst === null ? "–" : `${short(100 * ends.worst, 3)} %`]);
    }
    if (!viewing) {
      rows.push(["paths", count(state.paths ?? 0)], ["paths/s", count(state.paths_per_s ?? 0)]);
      rows.push(["rays", count(state.rays ?? 0)], ["left", duration(state.remaining_s)]);
      rows.push(["elapsed", duration(state.elapsed_s)], ["next", ends ? "each by itself" : state.samples_next ? `${state.samples_next} samples` : "–"]);
    }
    if (state.cube) {
      rows.push(["picture", `${state.cube.size[0]} × ${state.cube.size[1]}`], ["channels", String(state.channels)]);
      const tiles = viewing ? `${state.tiles_started ?? 0} of ${state.cube.tiles}` : `${state.units ?? 0} of ${state.units_total ?? 0} units`;
      if (!ends) rows.push([viewing ? "tiles begun" : "epoch", tiles]);
      rows.push(["on disk", bytes(state.cube.bytes)]);
    }
    find("numbers").replaceChildren(...rows.flatMap(([name, value]) => {
      const [dt, dd] = [document.createElement("dt"), document.createElement("dd")];
      dt.textContent = name;
      dd.textContent = value;
      return [dt, dd];
    }));
    const bar = find("bar");
    bar.value = viewing ? (state.cube ? (state.tiles_started ?? 0) / state.cube.tiles : 0) : (state.units ?? 0) / Math.max(1, state.units_total ?? 1);
    this.devices(state);
    if (state.curve) this.curve = state.curve;
    this.drawCurve();
  }

  devices(state) {
    const { find } = this;
    find("devices").hidden = !state.devices;
    if (!state.devices) return;
    // Rates of the last seconds, from the difference of two states.
    if (!this.before || state.rendering_s - this.before.at > 1.5 || state.rendering_s < this.before.at) {
      if (this.before && state.rendering_s > this.before.at)
        this.rates = state.devices.map((d, i) => (d.paths - this.before.paths[i]) / (state.rendering_s - this.before.at));
      this.before = { at: state.rendering_s, paths: state.devices.map((d) => d.paths) };
    }
    const now = (work) => {
      const epochs = [...new Set(work.map((w) => w.epoch))].sort((a, b) => a - b);
      const of = (epoch) => work.filter((w) => w.epoch === epoch).flatMap((w) => w.tiles);
      if (!epochs.length) return state.stage === "paused" ? "rests" : "–";
      return epochs.map((epoch) => `epoch ${epoch + 1}, tiles ${runs(of(epoch))}`).join("; ");
    };
    find("devices").tBodies[0].replaceChildren(...state.devices.map((d, i) => {
      const row = document.createElement("tr");
      const rate = this.rates[i] ?? d.paths / Math.max(1e-9, state.rendering_s);
      const busy = d.busy_s + d.idle_s > 0 ? `${Math.round((100 * d.busy_s) / (d.busy_s + d.idle_s))} %` : "–";
      for (const text of [d.name, count(rate), busy, String(d.units), now(d.work)]) row.insertCell().textContent = text;
      row.cells[0].title = d.name;
      return row;
    }));
  }

  drawCurve() {
    const { find, curve } = this;
    const points = curve.filter(([s, , e]) => s > 0 && e > 0);
    find("curve-box").hidden = points.length < 1;
    if (points.length < 1) return;
    const x = points.map((p) => p[0]), y = points.map((p) => p[2]);
    // Through the last point: error that falls with the square root of the time.
    const [lastX, lastY] = [x[x.length - 1], y[y.length - 1]];
    const data = [x, y, x.map((s) => lastY * Math.sqrt(lastX / s))];
    if (this.plot && this.theme === document.documentElement.dataset.theme) return void this.plot.setData(data);
    if (this.plot) this.plot.destroy();
    this.theme = document.documentElement.dataset.theme;
    // At least half a decade, so that there is something to read.
    const wide = (_, min, max) => {
      if (!(min > 0) || !(max > 0)) return [0.1, 10];
      const pad = Math.max(1.12, Math.sqrt(Math.max(1, 3.2 / (max / min))));
      return [min / pad, max * pad];
    };
    this.plot = new uPlot({
      ...this.size(),
      scales: { x: { time: false, distr: 3, log: 10, range: wide }, y: { distr: 3, log: 10, range: wide } },
      series: [
        {},
        { stroke: css("--accent"), width: 2, points: { show: true, size: 5, fill: css("--accent") } },
        { stroke: css("--soft"), width: 1, dash: [5, 4], points: { show: false } },
      ],
      axes: [axis("seconds of rendering", { values: logNumbers, size: 36 }), axis("error estimate", { values: logNumbers, size: 58 })],
      legend: { show: false },
      cursor: { show: false },
    }, data, find("curve-plot"));
  }

  restyle() {
    this.drawCurve();
  }
}
