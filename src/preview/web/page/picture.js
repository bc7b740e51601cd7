"use strict";
// The picture: squares of SIDE x SIDE values at power-of-two scales, fetched as numbers where they are looked at, so that
// exposure and colour maps are changed here. A coarse level of the whole picture is always there and lies below.

const SIDE = 256;
const BLOCK = 8;
const MOST_BYTES = 384 * 2 ** 20;
// Radiance that may be gone through for one look at single pixels of one channel.
const MOST_RADIANCE = 2 ** 31;
// After a round of refreshing, a pause of at least this, and of so many times what the round took.
const REFRESH_MS = 400;
const REFRESH_SHARE = 10;

// How numbers become colours is the server's to say: TONE has its sRGB, over square roots of linear values, and its map.
const MAPS = {
  grey: Uint8Array.from({ length: 768 }, (_, i) => Math.floor(i / 3)),
  inferno: Uint8Array.from(TONE.map),
};
const ENCODED = Uint8Array.from(TONE.srgb_steps.flatMap((steps, value) => Array(steps).fill(value)));
const encode = (v) => (v >= 1 ? 255 : v > 0 ? ENCODED[(Math.sqrt(v) * (ENCODED.length - 1) + 0.5) | 0] : 0);

// Shown by a colour map between two ends.
const isRanged = (mode) => mode === "temperature" || mode === "samples" || mode === "difference";
// Of which the server has every scale.
const isFine = (mode) => mode === "colour" || mode === "difference";

class Picture {
  constructor(canvas, changed) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d", { alpha: false });
    this.changed = changed; // called when what is shown has changed
    this.cube = null;
    this.squares = new Map();
    this.loading = 0;
    this.bytes = 0;
    this.show = { mode: "colour", k: 0, rgb: [0, 0, 0] };
    this.tone = { auto: true, ev: 0, map: "grey", low: 0, high: 1, autoRange: true };
    this.choice = null; // of light and paint, where there are choices
    this.white = ""; // what differences take for white, as the server asks for it
    this.look = 1; // counts changes of tone
    this.centre = [0, 0];
    this.zoom = 1;
    this.fitted = true;
    this.cursor = null;
    this.marks = [];
    this.work = [];
    this.region = null;
    this.nextRefresh = 0;
    this.refreshing = false;
    this.retryAt = 0;
    this.drawn = 0; // squares with data in the last frame, for tests
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  open(cube, channels) {
    const first = !this.cube;
    this.cube = cube;
    this.channels = channels;
    if (first) this.fit();
  }

  // Geometry ------------------------------------------------------------------------------------------------------
  resize() {
    const ratio = window.devicePixelRatio || 1, box = this.canvas.getBoundingClientRect();
    this.canvas.width = Math.max(1, Math.round(box.width * ratio));
    this.canvas.height = Math.max(1, Math.round(box.height * ratio));
    if (this.fitted) this.fit();
    this.paint();
  }

  // `zoom` is in device pixels a pixel of the picture.
  fit() {
    if (!this.cube) return;
    const [w, h] = this.cube.size, margin = 24;
    this.zoom = Math.min((this.canvas.width - margin) / w, (this.canvas.height - margin) / h);
    if (this.zoom > 2) this.zoom = Math.floor(2 * this.zoom) / 2;
    this.zoom = Math.max(this.zoom, 1e-4);
    this.centre = [w / 2, h / 2];
    this.fitted = true;
    this.paint();
  }

  // Zooms to `zoom`, keeping the point of the picture at the canvas's [x, y].
  zoomTo(zoom, at = [this.canvas.width / 2, this.canvas.height / 2]) {
    if (!this.cube) return;
    const before = this.toPicture(at);
    const fit = Math.min(this.canvas.width / this.cube.size[0], this.canvas.height / this.cube.size[1]);
    this.zoom = Math.max(Math.min(fit, 1) / 4, Math.min(128, zoom));
    const after = this.toPicture(at);
    this.move(before[0] - after[0], before[1] - after[1]);
  }

  move(dx, dy) {
    const [w, h] = this.cube.size, keep = (v, size) => Math.max(0, Math.min(size, v));
    this.centre = [keep(this.centre[0] + dx, w), keep(this.centre[1] + dy, h)];
    this.fitted = false;
    this.paint();
  }

  toPicture([x, y]) {
    return [(x - this.canvas.width / 2) / this.zoom + this.centre[0], (y - this.canvas.height / 2) / this.zoom + this.centre[1]];
  }

  toCanvas([x, y]) {
    return [(x - this.centre[0]) * this.zoom + this.canvas.width / 2, (y - this.centre[1]) * this.zoom + this.canvas.height / 2];
  }

  // The part of the picture in sight: x0, y0, x1, y1, or null.
  sight() {
    const [w, h] = this.cube.size;
    const [a, b] = [this.toPicture([0, 0]), this.toPicture([this.canvas.width, this.canvas.height])];
    const s = [Math.max(0, Math.floor(a[0])), Math.max(0, Math.floor(a[1])), Math.min(w, Math.ceil(b[0])), Math.min(h, Math.ceil(b[1]))];
    return s[0] < s[2] && s[1] < s[3] ? s : null;
  }

  // Squares -------------------------------------------------------------------------------------------------------
  what() {
    const { mode, k, rgb } = this.show;
    if (mode === "samples") return "show=samples";
    if (mode === "difference") return `show=difference${this.white}`;
    const under = this.choice ? `&choice=${this.choice}` : "";
    if (mode === "colour") return `show=colour${under}`;
    if (mode === "false") return `show=false&r=${rgb[0]}&g=${rgb[1]}&b=${rgb[2]}${under}`;
    return `show=${mode}&k=${k}${under}`;
  }

  // Values a pixel of the picture that are needed for this zoom, and those of the level that is always there.
  scales() {
    const [w, h] = this.cube.size, power = (v) => 2 ** Math.max(0, Math.floor(Math.log2(v)));
    const whole = 2 ** Math.max(0, Math.ceil(Math.log2(Math.max(w, h) / SIDE)));
    if (isFine(this.show.mode)) return { base: whole, fine: Math.min(whole, power(1 / this.zoom)) };
    const base = Math.max(BLOCK, whole);
    let fine = Math.min(base, power(1 / this.zoom));
    if (fine < BLOCK) {
      const s = this.sight() || [0, 0, 0, 0];
      const radiance = (s[2] - s[0]) * (s[3] - s[1]) * this.channels.count * 4;
      fine = radiance <= MOST_RADIANCE ? 1 : BLOCK;
    }
    return { base, fine };
  }

  // The squares of a level that are in sight.
  *inSight(scale, sight) {
    const side = SIDE * scale;
    for (let j = Math.floor(sight[1] / side); j * side < sight[3]; j++)
      for (let i = Math.floor(sight[0] / side); i * side < sight[2]; i++) yield this.square(scale, i, j);
  }

  // What automatic exposure goes by: of two choices the first, so that they can be compared.
  exposing() {
    return isRanged(this.show.mode) ? this.what() : this.what().replace("choice=b", "choice=a");
  }

  square(scale, i, j, what = this.what()) {
    const key = `${what}|${scale}|${i}|${j}`;
    let square = this.squares.get(key);
    if (!square) {
      const [w, h] = this.cube.size, side = SIDE * scale;
      const rect = [i * side, j * side, Math.min(w, (i + 1) * side), Math.min(h, (j + 1) * side)];
      square = { key, what, scale, rect, values: null, stale: true, urgent: false, loading: false, look: 0, canvas: null, used: 0 };
      this.squares.set(key, square);
    }
    square.used = performance.now();
    return square;
  }

  // Tiles a..b of the cube have changed.
  touch(ranges) {
    if (!ranges.length || !this.cube) return;
    const { tile, size } = this.cube, columns = Math.ceil(size[0] / tile[0]);
    const all = ranges.length > 200 || (ranges.length === 1 && ranges[0][1] - ranges[0][0] === this.cube.tiles);
    const touched = new Set();
    if (!all) for (const [a, b] of ranges) for (let t = a; t < b; t++) touched.add(t);
    for (const square of this.squares.values()) {
      if (square.stale) continue;
      const [x0, y0, x1, y1] = square.rect;
      square.stale = all;
      for (let y = Math.floor(y0 / tile[1]); !square.stale && y * tile[1] < y1; y++)
        for (let x = Math.floor(x0 / tile[0]); !square.stale && x * tile[0] < x1; x++)
          square.stale = touched.has(y * columns + x);
    }
    this.pump();
  }

  // What is shown under these choices, and what both make together, is fetched anew as soon as it is looked at.
  relit(choices) {
    for (const square of this.squares.values()) {
      const is = (part) => square.what.includes(part);
      if (is("show=difference") || choices.some((choice) => is(`choice=${choice}`))) square.stale = square.urgent = true;
    }
    this.pump();
  }

  // Fetches what is missing, then, at leisure, what is stale.
  pump() {
    const sight = this.cube && !document.hidden && this.sight();
    const now = performance.now();
    if (!sight || now < this.retryAt || this.over) return;
    const { base, fine } = this.scales(), [w, h] = this.cube.size;
    const wanted = [...this.inSight(base, [0, 0, w, h])];
    if (fine !== base) {
      const squares = [...this.inSight(fine, sight)], [cx, cy] = this.centre;
      const far = ({ rect: r }) => Math.hypot((r[0] + r[2]) / 2 - cx, (r[1] + r[3]) / 2 - cy);
      wanted.push(...squares.sort((a, b) => far(a) - far(b)));
    }
    if (this.exposing() !== this.what()) wanted.push(this.square(base, 0, 0, this.exposing()));
    for (const square of wanted) if ((!square.values || square.urgent) && !square.loading && this.loading < 3) this.load(square);
    if (this.refreshing || this.loading || now < this.nextRefresh) return;
    const stale = wanted.filter((square) => square.values && square.stale && !square.loading);
    if (!stale.length) return;
    this.refreshing = true;
    const began = performance.now();
    (async () => {
      for (const square of stale) if (square.what === this.what()) await this.load(square);
    })().finally(() => {
      this.refreshing = false;
      const took = performance.now() - began;
      this.nextRefresh = performance.now() + Math.max(REFRESH_MS, REFRESH_SHARE * took);
    });
  }

  // The server is about to go: what is stale in sight is fetched at once, and then nothing more.
  async end() {
    const sight = this.cube && this.sight();
    this.over = true;
    if (!sight) return;
    const { base, fine } = this.scales(), squares = new Set([...this.inSight(base, [0, 0, ...this.cube.size]), ...this.inSight(fine, sight)]);
    await Promise.all([...squares].filter((square) => square.stale && !square.loading).map((square) => this.load(square)));
  }

  async load(square) {
    square.loading = true;
    square.stale = square.urgent = false;
    this.loading++;
    try {
      const [x0, y0, x1, y1] = square.rect;
      const url = `/api/image?${square.what}&x0=${x0}&y0=${y0}&x1=${x1}&y1=${y1}&scale=${square.scale}&format=f32`;
      const answer = await fetch(url);
      if (!answer.ok) throw new Error((await answer.json()).error);
      const values = new Float32Array(await answer.arrayBuffer());
      this.bytes += values.byteLength - (square.values ? square.values.byteLength : 0);
      [square.width, square.height] = answer.headers.get("x-size").split(",").map(Number);
      square.planes = Number(answer.headers.get("x-planes"));
      square.ev = Number(answer.headers.get("x-exposure-ev"));
      square.range = (answer.headers.get("x-range-k") || answer.headers.get("x-range-samples") || answer.headers.get("x-range-de") || "").split(",").map(Number);
      square.values = values;
      square.look = 0;
      if (square.scale === this.scales().base) this.adapt();
      this.evict();
      this.changed();
      this.paint();
    } catch {
      // The server is busy, or gone: the page says so by the events.
      square.stale = true;
      this.retryAt = performance.now() + 1000;
    } finally {
      square.loading = false;
      this.loading--;
      setTimeout(() => this.pump());
    }
  }

  evict() {
    if (this.bytes <= MOST_BYTES) return;
    const old = [...this.squares.values()].filter((s) => s.values && !s.loading).sort((a, b) => a.used - b.used);
    for (const square of old) {
      if (this.bytes <= MOST_BYTES * 0.8) break;
      this.bytes -= square.values.byteLength;
      this.squares.delete(square.key);
    }
  }

  // Tone ----------------------------------------------------------------------------------------------------------
  retone(change) {
    Object.assign(this.tone, change);
    this.look++;
    this.adapt();
    this.paint();
  }

  setShow(change) {
    Object.assign(this.show, change);
    this.look++;
    this.adapt();
    this.paint();
    this.pump();
  }

  // Automatic exposure, and ends of the colour map: as the server has them for the whole picture.
  adapt() {
    if (!this.cube) return;
    const { tone } = this, ranged = isRanged(this.show.mode);
    if (ranged ? !tone.autoRange : !tone.auto) return;
    const whole = this.square(this.scales().base, 0, 0, this.exposing());
    if (!whole.values) return;
    const before = [tone.ev, tone.low, tone.high];
    if (ranged) [tone.low, tone.high] = whole.range;
    else tone.ev = whole.ev;
    if (before.some((v, i) => v !== [tone.ev, tone.low, tone.high][i])) {
      this.look++;
      this.changed();
    }
  }

  // Makes the pixels of a square.
  develop(square) {
    const { values, planes, width, height } = square, { tone } = this;
    square.canvas ||= document.createElement("canvas");
    if (square.canvas.width !== width || square.canvas.height !== height)
      [square.canvas.width, square.canvas.height] = [width, height];
    const context = square.canvas.getContext("2d"), image = context.createImageData(width, height), out = image.data;
    const scale = 2 ** tone.ev, map = MAPS[tone.map], n = width * height;
    const { mode } = this.show, ranged = isRanged(mode);
    // Of samples each step is as many times more.
    const place = mode === "samples" ? (v) => Math.log2(Math.max(v, 1e-9)) : (v) => v;
    const low = place(tone.low), span = place(tone.high) - low || 1e-9;
    for (let i = 0; i < n; i++) {
      const v = values[i * planes], o = 4 * i;
      if (v !== v) continue; // not rendered: transparent
      if (planes === 3) {
        out[o] = encode(v * scale);
        out[o + 1] = encode(values[3 * i + 1] * scale);
        out[o + 2] = encode(values[3 * i + 2] * scale);
      } else {
        const level = ranged ? (255 * Math.max(0, Math.min(1, (place(v) - low) / span)) + 0.5) | 0 : encode(v * scale);
        out[o] = map[3 * level];
        out[o + 1] = map[3 * level + 1];
        out[o + 2] = map[3 * level + 2];
      }
      out[o + 3] = 255;
    }
    context.putImageData(image, 0, 0);
    square.look = this.look;
  }

  // The value under a pixel, from the finest square that is there.
  valueAt(x, y) {
    let best = null;
    for (const square of this.squares.values()) {
      const [x0, y0, x1, y1] = square.rect;
      const there = square.values && square.what === this.what() && x >= x0 && x < x1 && y >= y0 && y < y1;
      if (there && (!best || square.scale < best.scale)) best = square;
    }
    if (!best) return null;
    const i = Math.floor((y - best.rect[1]) / best.scale) * best.width + Math.floor((x - best.rect[0]) / best.scale);
    return { scale: best.scale, values: Array.from(best.values.subarray(i * best.planes, (i + 1) * best.planes)) };
  }

  // Drawing -------------------------------------------------------------------------------------------------------
  paint() {
    if (this.painting) return;
    this.painting = true;
    requestAnimationFrame(() => {
      this.painting = false;
      this.draw();
      this.pump();
    });
  }

  draw() {
    const { context: c, canvas } = this, style = getComputedStyle(document.documentElement);
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.fillStyle = style.getPropertyValue("--mat");
    c.fillRect(0, 0, canvas.width, canvas.height);
    const sight = this.cube && this.sight();
    if (!sight) return;
    const { base, fine } = this.scales(), [w, h] = this.cube.size, [x, y] = this.toCanvas([0, 0]);
    c.fillStyle = "#000";
    c.fillRect(x, y, w * this.zoom, h * this.zoom);
    this.drawn = 0;
    for (let scale = base; scale >= fine; scale /= 2) {
      for (const square of this.inSight(scale, sight)) {
        if (!square.values) {
          if (scale !== base && scale !== fine) this.squares.delete(square.key);
          continue;
        }
        if (square.look !== this.look) this.develop(square);
        this.drawn++;
        const [a, b] = this.toCanvas(square.rect), side = square.scale * this.zoom;
        c.imageSmoothingEnabled = side < 1;
        // Blocks at the edge reach over the picture.
        c.save();
        c.beginPath();
        c.rect(x, y, w * this.zoom, h * this.zoom);
        c.clip();
        c.drawImage(square.canvas, a, b, square.width * side, square.height * side);
        c.restore();
      }
    }
    this.drawMarks();
  }

  drawMarks() {
    const { context: c } = this, ratio = window.devicePixelRatio || 1;
    const outline = (x0, y0, x1, y1, colour, dash) => {
      const [a, b] = this.toCanvas([x0, y0]), [d, e] = this.toCanvas([x1, y1]);
      for (const [style, width] of [["#000a", 3], [colour, 1.25]]) {
        c.strokeStyle = style;
        c.lineWidth = width * ratio;
        c.setLineDash(dash ? [4 * ratio, 3 * ratio] : []);
        c.strokeRect(a, b, Math.max(1, d - a), Math.max(1, e - b));
      }
      c.setLineDash([]);
    };
    const { tile, size } = this.cube, columns = Math.ceil(size[0] / tile[0]);
    c.strokeStyle = "#fff8";
    c.lineWidth = ratio;
    for (const t of this.work) {
      const [x, y] = [(t % columns) * tile[0], Math.floor(t / columns) * tile[1]];
      const [a, b] = this.toCanvas([x, y]), [d, e] = this.toCanvas([Math.min(size[0], x + tile[0]), Math.min(size[1], y + tile[1])]);
      const arm = Math.min(10 * ratio, (d - a) / 3, (e - b) / 3);
      c.beginPath();
      for (const [px, py, sx, sy] of [[a, b, 1, 1], [d, b, -1, 1], [a, e, 1, -1], [d, e, -1, -1]]) {
        c.moveTo(px + sx * arm, py + sy * 0.5);
        c.lineTo(px + sx * 0.5, py + sy * 0.5);
        c.lineTo(px + sx * 0.5, py + sy * arm);
      }
      c.stroke();
    }
    for (const mark of this.marks) {
      if (mark.x1 !== undefined) {
        outline(mark.x, mark.y, mark.x1, mark.y1, mark.colour);
        continue;
      }
      const [a, b] = this.toCanvas([mark.x + 0.5, mark.y + 0.5]);
      c.beginPath();
      c.arc(a, b, Math.max(5 * ratio, this.zoom * 0.7), 0, 2 * Math.PI);
      c.strokeStyle = "#000c";
      c.lineWidth = 4 * ratio;
      c.stroke();
      c.strokeStyle = mark.colour;
      c.lineWidth = 2 * ratio;
      c.stroke();
    }
    if (this.region) outline(...this.region, "#fff", true);
    if (this.cursor && this.keyboard) {
      const [a, b] = this.toCanvas([this.cursor[0] + 0.5, this.cursor[1] + 0.5]), arm = 9 * ratio;
      for (const [style, width] of [["#000", 3], ["#fff", 1]]) {
        c.strokeStyle = style;
        c.lineWidth = width * ratio;
        c.beginPath();
        c.moveTo(a - arm, b), c.lineTo(a + arm, b), c.moveTo(a, b - arm), c.lineTo(a, b + arm);
        c.stroke();
      }
    }
  }
}
