// Spectra of pinned pixels and regions, and of the pixel under the cursor.

const COLOURS = ["#e4572e", "#2e86de", "#29a36a", "#9b59d0", "#d4a017", "#d6418f", "#17a2a8", "#8a6d3b"];
const RADIANCE = "W m⁻² sr⁻¹ nm⁻¹";
const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const POWERS = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
// A number for people, with three or four digits.
function short(v, digits = 4) {
  if (v === null || v === undefined || !isFinite(v)) return "–";
  const size = Math.abs(v);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) {
    const [mantissa, exponent] = v.toExponential(digits - 1).split("e");
    return `${Number(mantissa)}·10${[...String(Number(exponent))].map((c) => POWERS[c]).join("")}`;
  }
  return String(Number(v.toPrecision(digits)));
}
const axis = (label, more = {}) => ({
  label, labelSize: 22, labelFont: "12px system-ui, sans-serif", font: "11px system-ui, sans-serif",
  stroke: css("--ink"), grid: { stroke: css("--grid"), width: 1 }, ticks: { stroke: css("--line"), width: 1 }, ...more,
});
const numbers = (_, splits) => splits.map((v) => (v === null ? "" : short(v, 3)));
// Labels of a logarithmic axis: 1, 2 and 5 of each decade where that leaves room, else the decades.
const logNumbers = (_, splits) => {
  const decades = new Set(splits.filter((v) => v > 0).map((v) => Math.floor(Math.log10(v) + 1e-9))).size;
  return splits.map((v) => {
    if (!(v > 0)) return "";
    const digit = Math.round(v / 10 ** Math.floor(Math.log10(v) + 1e-9));
    return digit === 1 || (decades <= 2 && (digit === 2 || digit === 5)) ? short(v, 2) : "";
  });
};

class Spectra {
  constructor(box, list, changed, pick) {
    this.box = box;
    this.list = list;
    this.changed = changed;
    this.pick = pick; // called with a channel that was clicked in the plot
    this.pins = [];
    this.hover = null;
    this.logX = this.logY = false;
    this.choices = () => [null, null]; // of light and paint: the one that is shown, and the other where it is drawn, too
    this.white = () => ""; // what differences take for white
    this.shown = null; // the channels to mark
    this.next = 0;
    this.due = []; // what asks for pins to be fetched again
    new ResizeObserver(() => this.plot && this.plot.setSize(this.size())).observe(box);
  }

  open(channels) {
    this.channels = channels;
    const { bounds_nm: bounds, centre_nm: centre, count } = channels;
    this.order = [...Array(count).keys()].sort((a, b) => centre[a] - centre[b]);
    const overlap = this.order.some((k, i) => i && bounds[k][0] < bounds[this.order[i - 1]][1] * (1 - 1e-12));
    // Every channel a level over its own interval; with many, or where they overlap, a point each.
    this.x = [];
    this.from = [];
    const push = (nm, k) => { this.x.push(nm); this.from.push(k); };
    this.order.forEach((k, i) => {
      if (overlap || count > 1000) return push(centre[k], k);
      const last = i ? bounds[this.order[i - 1]][1] : bounds[k][0];
      if (bounds[k][0] > last * (1 + 1e-9)) push((last + bounds[k][0]) / 2, -1);
      push(bounds[k][0], k);
      push(bounds[k][1], k);
    });
    this.build();
  }

  isCounts() {
    return this.channels.quantity === "counts";
  }

  size() {
    return { width: Math.max(200, this.box.clientWidth), height: 270 };
  }

  items() {
    return this.hover ? [...this.pins, this.hover] : this.pins;
  }

  // The plot, anew: uPlot's series are fixed.
  build() {
    if (!this.channels) return;
    if (this.plot) this.plot.destroy();
    const series = [{}], bands = [];
    for (const item of this.items()) {
      const colour = item.colour;
      if (item.standard_error && !item.other) {
        bands.push({ series: [series.length, series.length + 1], fill: colour + "38" });
        series.push({ stroke: "transparent", points: { show: false } }, { stroke: "transparent", points: { show: false } });
      }
      const points = { show: this.channels.count === 1, size: 8, stroke: colour, fill: colour };
      const width = item === this.hover ? 1 : 1.75;
      series.push({ stroke: colour, width, points });
      if (item.other) series.push({ stroke: colour, width, points, dash: [6, 4] });
    }
    const log = (on) => (on ? { distr: 3, log: 10 } : {});
    const lowest = (_, min, max) => {
      if (min === null || max === null) return [0, 1];
      const pad = 0.05 * (max - Math.min(0, min)) || 1;
      return [min < 0 ? min - pad : 0, max + pad];
    };
    this.plot = new uPlot({
      ...this.size(), series, bands,
      scales: {
        x: { time: false, ...log(this.logX) },
        y: this.logY ? log(true) : { range: lowest },
      },
      axes: [
        axis("wavelength (nm)", { values: this.logX ? logNumbers : numbers, size: 40 }),
        axis(this.isCounts() ? "counts" : `spectral radiance (${RADIANCE})`, { values: this.logY ? logNumbers : numbers, size: 66 }),
      ],
      legend: { show: false },
      cursor: { drag: { x: true, y: false }, points: { show: false }, y: false },
      hooks: { draw: [(u) => this.drawShown(u)] },
    }, this.data(), this.box);
    this.plot.over.addEventListener("click", (event) => {
      const nm = this.plot.posToVal(event.offsetX, "x");
      this.pick(this.channelAt(nm));
    });
  }

  data() {
    const value = (list, k) => (k < 0 || list[k] === null || (this.logY && list[k] <= 0) ? null : list[k]);
    const rows = [this.x];
    for (const item of this.items()) {
      const { radiance, standard_error: error } = item;
      if (error && !item.other) {
        const edge = (sign) => radiance.map((v, k) => (v === null || error[k] === null ? null : v + sign * error[k]));
        for (const side of [edge(1), edge(-1)]) rows.push(this.from.map((k) => value(side, k)));
      }
      rows.push(this.from.map((k) => value(radiance, k)));
      if (item.other) rows.push(this.from.map((k) => value(item.other, k)));
    }
    return rows;
  }

  // Marks the channels in the picture.
  drawShown(u) {
    const c = u.ctx, { left, top, width, height } = u.bbox;
    for (const [k, colour] of this.shown || []) {
      const x = u.valToPos(this.channels.centre_nm[k], "x", true);
      if (x < left || x > left + width) continue;
      c.save();
      c.strokeStyle = colour || css("--soft");
      c.setLineDash([4, 4]);
      c.beginPath();
      c.moveTo(x, top), c.lineTo(x, top + height);
      c.stroke();
      c.restore();
    }
  }

  show(channels) {
    this.shown = channels;
    if (this.plot) this.plot.redraw(false);
  }

  // The channel whose centre is nearest.
  channelAt(nm) {
    const far = (k) => Math.abs(this.channels.centre_nm[k] - nm);
    return this.order.reduce((best, k) => (far(k) < far(best) ? k : best));
  }

  update() {
    const layout = this.items().map((i) => `${i.colour}${!!i.standard_error}${!!i.other}`).join();
    if (!this.plot || layout !== this.layout) {
      this.layout = layout;
      this.build();
    } else this.plot.setData(this.data());
  }

  // `isPinned`: with what both choices differ by.
  async fetch({ x, y, x1, y1 }, isPinned = true) {
    const place = `x=${x}&y=${y}${x1 === undefined ? "" : `&x1=${x1}&y1=${y1}`}`, [own, other] = this.choices();
    const ask = async (what) => {
      const answer = await fetch(`/api/${what}`), body = await answer.json();
      if (!answer.ok) throw new Error(body.error);
      return body;
    };
    const under = (choice) => ask(`spectrum?${place}${choice ? `&choice=${choice}` : ""}`);
    const differ = isPinned && other && this.channels.isColour ? ask(`difference?${place}${this.white()}`).catch(() => null) : null;
    const [body, second, difference] = await Promise.all([under(own), other && under(other), differ]);
    const { radiance, standard_error, samples, pixels } = body;
    return { radiance, standard_error, samples, pixels, other: second?.radiance ?? null, difference };
  }

  async pin(place) {
    const same = (p) => p.x === place.x && p.y === place.y && p.x1 === place.x1 && p.y1 === place.y1;
    if (this.pins.some(same)) return;
    const used = new Set(this.pins.map((p) => p.colour));
    const colour = COLOURS.find((c) => !used.has(c)) || COLOURS[this.next++ % COLOURS.length];
    const pin = { ...place, colour, ...(await this.fetch(place)) };
    if (this.pins.some(same)) return;
    this.pins.push(pin);
    this.hover = null;
    this.list_();
    this.update();
    this.changed();
  }

  remove(pin) {
    this.pins = this.pins.filter((p) => p !== pin);
    this.list_();
    this.update();
    this.changed();
  }

  clear() {
    this.pins = [];
    this.list_();
    this.update();
    this.changed();
  }

  // The pixel under the cursor: one request at a time, the latest place next.
  async peek(place) {
    this.wanted = place;
    if (this.peeking) return;
    this.peeking = true;
    while (this.wanted) {
      const place = this.wanted;
      this.wanted = null;
      try {
        this.hover = { ...place, colour: css("--soft"), ...(await this.fetch(place, false)) };
      } catch {
        this.hover = null;
      }
      this.update();
      await new Promise((done) => setTimeout(done, 40));
    }
    this.peeking = false;
  }

  leave() {
    this.wanted = null;
    if (this.hover) {
      this.hover = null;
      this.update();
    }
  }

  // Fetches the pins for which `changed` holds again; what comes while that goes on, after it.
  refresh(changed) {
    this.due.push(changed);
    const all = async () => {
      while (this.due.length) {
        const due = this.due.splice(0);
        for (const pin of this.pins) {
          if (!due.some((changed) => changed(pin))) continue;
          try {
            Object.assign(pin, await this.fetch(pin));
          } catch {
            // It stays as it is until the next change.
          }
        }
        this.list_();
        this.update();
      }
    };
    this.refreshing ||= all().finally(() => (this.refreshing = null));
    return this.refreshing;
  }

  list_() {
    const items = this.pins.map((pin) => {
      const item = document.createElement("li"), dot = document.createElement("i");
      dot.style.background = pin.colour;
      const text = document.createElement("span"), value = document.createElement("span");
      text.textContent = pin.x1 === undefined ? `${pin.x}, ${pin.y}` : `${pin.x}–${pin.x1 - 1}, ${pin.y}–${pin.y1 - 1}: mean of ${pin.pixels}`;
      value.className = "value";
      const mean = pin.radiance.reduce((sum, v) => sum + v, 0) / pin.radiance.length;
      value.textContent = this.isCounts() ? `mean ${short(mean)}` : `${pin.samples} samples, mean ${short(mean)}`;
      if (pin.difference) {
        const { a, b, delta_e_2000: delta } = pin.difference, words = ({ lab }) => lab.map((v) => v.toFixed(1)).join(", ");
        value.textContent = `ΔE ${delta.toFixed(2)}`;
        value.title = `L*, a*, b* under A: ${words(a)}; under B: ${words(b)}`;
      }
      const close = document.createElement("button");
      close.textContent = "×";
      close.title = "Forget this one";
      close.setAttribute("aria-label", `Forget ${text.textContent}`);
      close.addEventListener("click", () => this.remove(pin));
      item.append(dot, text, value, close);
      return item;
    });
    this.list.replaceChildren(...items);
  }

  // One line a channel, in the order of the cube; columns for every pin.
  csv() {
    const name = (p) => (p.x1 === undefined ? `${p.x}_${p.y}` : `${p.x}_${p.y}_to_${p.x1 - 1}_${p.y1 - 1}`);
    const one = this.pins.length === 1, quantity = this.isCounts() ? "counts" : "radiance";
    const head = this.pins.flatMap((p) => {
      const end = one ? "" : `_${name(p)}`, [own, other] = this.choices();
      if (p.other) return [`${quantity}_${own}${end}`, `${quantity}_${other}${end}`];
      return p.standard_error ? [`${quantity}${end}`, `standard_error${end}`] : [`${quantity}${end}`];
    });
    const lines = this.channels.centre_nm.map((nm, k) =>
      [nm, ...this.pins.flatMap((p) => (p.other ? [p.radiance[k], p.other[k]] : p.standard_error ? [p.radiance[k], p.standard_error[k]] : [p.radiance[k]]))]
        .map((v) => (v === null ? "NaN" : v)).join());
    return [["wavelength_nm", ...head].join(), ...lines].join("\n") + "\n";
  }
}
