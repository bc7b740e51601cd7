// Ties it together: events from the server, keys, pointers.

const find = (id) => document.getElementById(id);
const STAGES = { preparing: "preparing", rendering: "rendering", paused: "paused", done: "finished", stopped: "stopped",
  failed: "failed", viewing: "cube on disk", gone: "no connection" };

const page = { state: null, channels: null, held: null, events: null };
const picture = new Picture(find("picture"), () => { showTone(); showCursor(); });
const spectra = new Spectra(find("spectrum-plot"), find("pins"), () => showPins(), (k) => choose(k));
const progress = new Progress(find);
const relight = new Relight(find, (choices) => relit(choices));
spectra.choices = () => (relight.isThere() ? [relight.shown, relight.differs() ? relight.other() : null] : [null, null]);
spectra.white = () => picture.white;
// For scripts, such as the tests that drive this page.
window.spectile = { page, picture, spectra, progress, relight };

// Theme -----------------------------------------------------------------------------------------------------------
const dark = matchMedia("(prefers-color-scheme: dark)");
function setTheme(theme) {
  document.documentElement.dataset.theme = theme;
  spectra.build();
  progress.restyle();
  picture.paint();
}
dark.addEventListener("change", () => setTheme(dark.matches ? "dark" : "light"));
find("theme").addEventListener("click", () => setTheme(document.documentElement.dataset.theme === "dark" ? "light" : "dark"));
setTheme(dark.matches ? "dark" : "light");

// What is shown ---------------------------------------------------------------------------------------------------
function setMode(mode) {
  const { channels } = page;
  if (!channels || (mode === "temperature" && !channels.thermal.length)) return;
  if (mode === "difference" && !hasDifferences()) return;
  const change = { mode };
  if (mode === "temperature" && !channels.thermal.includes(picture.show.k)) change.k = channels.thermal[0];
  if (isRanged(mode)) Object.assign(picture.tone, { map: "inferno", autoRange: true });
  if (mode === "channel") picture.tone.map = "grey";
  picture.setShow(change);
  showControls();
}

// Shows a single channel, or stays with what shows single channels.
function choose(k) {
  const { thermal } = page.channels, heat = picture.show.mode === "temperature" && thermal.includes(k);
  picture.setShow({ k, mode: heat ? "temperature" : "channel" });
  showControls();
}

// Steps through the channels in the order of their wavelengths.
function step(by) {
  if (!page.channels) return;
  const heat = picture.show.mode === "temperature";
  const order = spectra.order.filter((k) => !heat || page.channels.thermal.includes(k));
  const at = order.indexOf(picture.show.k);
  choose(order[Math.max(0, Math.min(order.length - 1, at + by))]);
}

const channelName = (k) => {
  const [from, to] = page.channels.bounds_nm[k], own = page.channels.names[k];
  const text = `${k}: ${short(from, 6)}–${short(to, 6)} nm`;
  return /^[\d.]+ nm$/.test(own) ? text : `${text} (${own})`;
};

function showControls() {
  const { mode, k, rgb } = picture.show, { channels } = page;
  for (const button of document.querySelectorAll("[data-mode]")) {
    button.setAttribute("aria-checked", String(button.dataset.mode === mode));
    if (button.dataset.mode === "temperature") button.hidden = !channels || !channels.thermal.length;
    if (button.dataset.mode === "colour" && page.state?.cube) button.textContent = page.state.cube.shows === "xyz" ? "True colour" : "Preview";
  }
  document.querySelector('[data-mode="difference"]').hidden = !hasDifferences();
  const single = mode === "channel" || mode === "temperature";
  find("channel-bar").hidden = !single;
  find("rgb-bar").hidden = mode !== "false";
  find("map-label").hidden = !single && !isRanged(mode);
  find("map").value = picture.tone.map;
  find("range-label").hidden = !isRanged(mode);
  find("range-unit").textContent = { samples: "samples", difference: "ΔE" }[mode] ?? "K";
  find("ev-label").hidden = isRanged(mode);
  if (!channels) return;
  const order = spectra.order.filter((c) => mode !== "temperature" || channels.thermal.includes(c));
  find("channel").max = order.length - 1;
  find("channel").value = order.indexOf(k);
  find("channel-name").textContent = channelName(k);
  for (const input of document.querySelectorAll("[data-rgb]")) {
    input.max = channels.count - 1;
    input.value = spectra.order.indexOf(rgb[input.dataset.rgb]);
  }
  find("rgb-name").textContent = rgb.map((c) => `${short(channels.centre_nm[c], 5)}`).join(", ") + " nm";
  spectra.show(single ? [[k]] : mode === "false" ? rgb.map((c, i) => [c, ["#d33", "#2a2", "#36e"][i]]) : []);
  showTone();
  picture.paint();
}

function showTone() {
  const { tone, show } = picture, ranged = isRanged(show.mode);
  const set = (id, text) => document.activeElement === find(id) || (find(id).value = text);
  set("ev", tone.ev.toFixed(2));
  set("low", tone.low.toFixed(1));
  set("high", tone.high.toFixed(1));
  find("auto").checked = ranged ? tone.autoRange : tone.auto;
  const c = find("legend").getContext("2d"), map = MAPS[tone.map];
  for (let x = 0; x < 96; x++) {
    const l = 3 * Math.floor((255 * x) / 95);
    c.fillStyle = `rgb(${map[l]} ${map[l + 1]} ${map[l + 2]})`;
    c.fillRect(x, 0, 1, 12);
  }
}

const setAuto = (on) => picture.retone(isRanged(picture.show.mode) ? { autoRange: on } : { auto: on });
const expose = (by) => { picture.retone({ auto: false, ev: picture.tone.ev + by }); showTone(); };

for (const button of document.querySelectorAll("[data-mode]")) button.addEventListener("click", () => setMode(button.dataset.mode));
find("channel").addEventListener("input", (event) => {
  const heat = picture.show.mode === "temperature";
  choose(spectra.order.filter((k) => !heat || page.channels.thermal.includes(k))[event.target.value]);
});
for (const input of document.querySelectorAll("[data-rgb]")) input.addEventListener("input", () => {
  const rgb = [...picture.show.rgb];
  rgb[input.dataset.rgb] = spectra.order[input.value];
  picture.setShow({ rgb });
  showControls();
});
find("map").addEventListener("change", (event) => { picture.retone({ map: event.target.value }); showTone(); });
find("ev").addEventListener("input", (event) => isFinite(event.target.valueAsNumber) && picture.retone({ auto: false, ev: event.target.valueAsNumber }) && showTone());
find("ev").addEventListener("input", () => (find("auto").checked = picture.tone.auto));
for (const id of ["low", "high"]) find(id).addEventListener("input", (event) => {
  if (isFinite(event.target.valueAsNumber)) picture.retone({ autoRange: false, [id]: event.target.valueAsNumber });
  find("auto").checked = picture.tone.autoRange;
});
find("auto").addEventListener("change", (event) => { setAuto(event.target.checked); showTone(); });
find("fit").addEventListener("click", () => picture.fit());
find("actual").addEventListener("click", () => picture.zoomTo(window.devicePixelRatio || 1));
find("in").addEventListener("click", () => picture.zoomTo(picture.zoom * 1.5));
find("out").addEventListener("click", () => picture.zoomTo(picture.zoom / 1.5));

// Light and paint -------------------------------------------------------------------------------------------------
const hasDifferences = () => relight.isThere() && relight.what.colours;

// The pictures of these choices are others; null: another of both is shown.
function relit(choices) {
  picture.choice = relight.shown;
  picture.setShow({});
  if (choices) picture.relit(choices);
  showControls();
  if (page.channels) {
    page.channels.isColour = relight.what.colours;
    spectra.refresh(() => true).then(() => showPins());
  }
}

// What is white: daylight by the picture of A, or a pixel that is pinned.
function showWhite() {
  const select = find("white"), chosen = select.value;
  const pixels = spectra.pins.filter((pin) => pin.x1 === undefined).map((pin) => `${pin.x},${pin.y}`);
  const options = [["", "daylight D65, by A's exposure"], ...pixels.map((at) => [at, `the pixel ${at.replace(",", ", ")}`])];
  select.replaceChildren(...options.map(([value, text]) => element("option", { value, textContent: text })));
  select.value = pixels.includes(chosen) ? chosen : "";
  find("white-factor-label").hidden = !select.value;
  const [x, y] = select.value.split(","), factor = find("white-factor").valueAsNumber;
  const white = select.value ? `&white_x=${x}&white_y=${y}&white_factor=${factor > 0 ? factor : 1}` : "";
  if (white === picture.white) return;
  picture.white = white;
  picture.setShow({});
  if (relight.differs()) spectra.refresh(() => true);
}
for (const id of ["white", "white-factor"]) find(id).addEventListener("change", showWhite);

// Pins ------------------------------------------------------------------------------------------------------------
function showPins() {
  picture.marks = spectra.pins;
  showWhite();
  picture.paint();
  find("csv").disabled = find("clear").disabled = !spectra.pins.length;
}

function download() {
  if (!spectra.pins.length) return;
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([spectra.csv()], { type: "text/csv" }));
  link.download = "spectra.csv";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
find("csv").addEventListener("click", download);
find("clear").addEventListener("click", () => spectra.clear());
for (const [id, name] of [["log-x", "logX"], ["log-y", "logY"]]) find(id).addEventListener("change", (event) => {
  spectra[name] = event.target.checked;
  spectra.build();
});

const inside = ([x, y]) => page.state?.cube && x >= 0 && y >= 0 && x < page.state.cube.size[0] && y < page.state.cube.size[1];

function showCursor() {
  const at = picture.cursor;
  find("zoom").textContent = page.state?.cube ? `${short((100 * picture.zoom) / (window.devicePixelRatio || 1), 3)} %` : "";
  if (!at) return void (find("cursor").textContent = "\u00a0");
  const found = picture.valueAt(...at), { mode } = picture.show;
  let text = `column ${at[0]}, row ${at[1]}`;
  if (found && !found.values.some(Number.isNaN)) {
    const unit = { temperature: "K", samples: "samples", colour: "linear R, G, B", difference: "ΔE 2000" }[mode] ?? RADIANCE;
    text += `: ${found.values.map((v) => short(v)).join(", ")} ${unit}`;
    if (found.scale > 1) text += ` (mean of ${found.scale} × ${found.scale})`;
  }
  find("cursor").textContent = text;
}

async function pin(place) {
  if (page.ended) return notice("The render has ended; `spectile view` opens its cube.", 4000);
  try {
    await spectra.pin(place);
  } catch (error) {
    notice(error.message, 2500);
  }
}

// Pointers: drag moves, a click pins, Shift-drag takes a region, two fingers or the wheel zoom -------------------------
{
  const canvas = find("picture"), pointers = new Map();
  let drag = null;
  const at = (event) => {
    const box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
    return [(event.clientX - box.left) * ratio, (event.clientY - box.top) * ratio];
  };
  const pixel = (event) => picture.toPicture(at(event)).map(Math.floor);
  const rectangle = (a, b) => {
    const [w, h] = page.state.cube.size, keep = (v, end) => Math.max(0, Math.min(end, v));
    const [x, y] = [0, 1].map((i) => keep(Math.min(a[i], b[i]), [w, h][i]));
    const [x1, y1] = [0, 1].map((i) => keep(Math.max(a[i], b[i]) + 1, [w, h][i]));
    return x < x1 && y < y1 ? [x, y, x1, y1] : null;
  };
  canvas.addEventListener("pointerdown", (event) => {
    if (!page.state?.cube || event.button > 1) return;
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at(event));
    drag = { from: at(event), last: at(event), pixel: pixel(event), moved: pointers.size > 1, region: event.shiftKey };
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!page.state?.cube) return;
    const now = at(event);
    if (!pointers.size) {
      const over = pixel(event);
      keys(false);
      picture.cursor = inside(over) ? over : null;
      if (picture.cursor && !page.ended) spectra.peek({ x: over[0], y: over[1] });
      else spectra.leave();
      return showCursor();
    }
    if (!pointers.has(event.pointerId)) return;
    if (pointers.size === 2) {
      const span = () => { const [a, b] = [...pointers.values()]; return Math.hypot(a[0] - b[0], a[1] - b[1]); };
      const before = span();
      pointers.set(event.pointerId, now);
      const [a, b] = [...pointers.values()];
      picture.zoomTo((picture.zoom * span()) / Math.max(1, before), [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]);
    } else if (drag) {
      pointers.set(event.pointerId, now);
      drag.moved ||= Math.hypot(now[0] - drag.from[0], now[1] - drag.from[1]) > 4;
      if (drag.region) picture.region = rectangle(drag.pixel, pixel(event));
      else if (drag.moved) picture.move((drag.last[0] - now[0]) / picture.zoom, (drag.last[1] - now[1]) / picture.zoom);
      drag.last = now;
      picture.paint();
    }
    showCursor();
  });
  const up = (event) => {
    if (!pointers.delete(event.pointerId)) return;
    if (drag && event.type === "pointerup") {
      const over = pixel(event);
      if (drag.region && drag.moved) {
        const r = rectangle(drag.pixel, over);
        if (r) pin({ x: r[0], y: r[1], x1: r[2], y1: r[3] });
      } else if (!drag.moved && inside(over)) pin({ x: over[0], y: over[1] });
    }
    picture.region = null;
    if (!pointers.size) drag = null;
    picture.paint();
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
  canvas.addEventListener("pointerleave", () => {
    if (pointers.size || picture.keyboard) return;
    picture.cursor = null;
    spectra.leave();
    showCursor();
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === 1 ? 30 : 1;
    picture.zoomTo(picture.zoom * 2 ** (-event.deltaY * lines / 240), at(event));
    showCursor();
  }, { passive: false });
}

// Keys ------------------------------------------------------------------------------------------------------------
// Whether the cursor is moved by keys, and drawn.
function keys(on) {
  picture.keyboard = on;
  find("picture").classList.toggle("keys", on);
}

function moveCursor(dx, dy) {
  if (!page.state?.cube) return;
  const [w, h] = page.state.cube.size, [x, y] = picture.cursor || picture.centre.map(Math.floor);
  const moved = picture.cursor ? [x + dx, y + dy] : [x, y];
  picture.cursor = [Math.max(0, Math.min(w - 1, moved[0])), Math.max(0, Math.min(h - 1, moved[1]))];
  keys(true);
  if (!page.ended) spectra.peek({ x: picture.cursor[0], y: picture.cursor[1] });
  picture.paint();
  showCursor();
}

document.addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || find("keys").open) return;
  const { target, key } = event, typing = target.matches("input[type=number], input[type=text], select");
  if (typing && key !== "Escape") return;
  const far = event.shiftKey ? 10 : 1, onPicture = target === find("picture") || target === document.body;
  const arrows = { ArrowLeft: [-far, 0], ArrowRight: [far, 0], ArrowUp: [0, -far], ArrowDown: [0, far] };
  const act = {
    1: () => setMode("colour"), 2: () => setMode("channel"), 3: () => setMode("false"), 4: () => setMode("temperature"), 5: () => setMode("samples"),
    6: () => setMode("difference"), x: () => relight.isThere() && relight.show(relight.other()),
    ",": () => step(-1), ".": () => step(1), "<": () => step(-10), ">": () => step(10), ";": () => step(-10), ":": () => step(10),
    e: () => expose(-0.25), E: () => expose(0.25), a: () => { setAuto(true); showTone(); },
    "+": () => picture.zoomTo(picture.zoom * 1.5), "=": () => picture.zoomTo(picture.zoom * 1.5), "-": () => picture.zoomTo(picture.zoom / 1.5),
    0: () => picture.fit(), 9: () => picture.zoomTo(window.devicePixelRatio || 1),
    c: download, Escape: () => (typing ? target.blur() : spectra.clear()), s: () => control("save"), "?": () => find("keys").showModal(),
  }[key];
  if (act) act();
  else if (onPicture && arrows[key]) moveCursor(...arrows[key]);
  else if (onPicture && key === "Enter" && picture.cursor) pin({ x: picture.cursor[0], y: picture.cursor[1] });
  else if (onPicture && key === " ") control(page.state?.stage === "paused" ? "resume" : "pause");
  else return;
  event.preventDefault();
  showCursor();
});
find("help").addEventListener("click", () => find("keys").showModal());

// Controls --------------------------------------------------------------------------------------------------------
async function control(what) {
  if (!page.state?.controls || page.ended) return;
  try {
    const answer = await fetch(`/api/${what}`, { method: "POST" });
    if (!answer.ok) throw new Error((await answer.json()).error);
    if (what === "save") notice("Saved: everything merged so far is on disk.", 1800);
  } catch (error) {
    notice(error.message, 3000);
  }
}
find("pause").addEventListener("click", () => control(page.state?.stage === "paused" ? "resume" : "pause"));
find("save").addEventListener("click", () => control("save"));
find("stop").addEventListener("click", () => {
  if (confirm("Stop this render? Everything merged stays, and --resume goes on from there.")) control("stop");
});

let noticeUntil = null;
function notice(text, ms) {
  clearTimeout(noticeUntil);
  find("notice").textContent = text;
  find("notice").hidden = !text;
  if (ms) noticeUntil = setTimeout(() => (find("notice").hidden = true), ms);
}

// Events ----------------------------------------------------------------------------------------------------------
function stage(name) {
  find("stage").textContent = STAGES[name] || name;
  find("stage").dataset.stage = name;
}

let changedPins = [], pinsAt = 0;
async function hear(state) {
  page.state = state;
  stage(state.stage);
  find("name").textContent = state.name;
  document.title = `${state.name} – Spectile`;
  find("controls").hidden = !state.controls;
  find("pause").textContent = state.stage === "paused" ? "Resume" : "Pause";
  const error = state.error_estimate ? `, error ${short(100 * state.error_estimate, 3)} %` : "";
  find("summary").textContent = state.cube ? `${state.samples ?? 0} samples/pixel${error}` : "";
  progress.update(state);
  if (!state.cube) return notice("Preparing devices and shaders …");
  if (!page.channels) {
    if (page.opening) return;
    page.opening = true;
    try {
      const answer = await fetch("/api/channels");
      if (!answer.ok) throw new Error("no channels yet");
      const channels = await answer.json();
      page.channels = channels;
      spectra.open(channels);
      picture.show.rgb = channels.rgb;
      picture.show.k = spectra.order[(channels.count - 1) >> 1];
      // All that a thermal camera sees is how warm things are.
      if (channels.thermal.length === channels.count) {
        picture.show.mode = "temperature";
        picture.tone.map = "inferno";
      }
      if (state.exposure_ev !== null) Object.assign(picture.tone, { auto: false, ev: state.exposure_ev });
      picture.open(state.cube, channels);
      notice("");
      showControls();
      showCursor();
    } finally {
      page.opening = false;
    }
  }
  relight.hear(state.relight);
  picture.work = state.stage === "rendering" ? (state.devices || []).flatMap((d) => d.work.flatMap((w) => w.tiles)) : [];
  picture.touch(state.changed || []);
  picture.paint();
  changedPins.push(...(state.changed || []));
  if (spectra.pins.length && changedPins.length && performance.now() > pinsAt && !page.ended) {
    const ranges = changedPins, { tile, size } = state.cube, columns = Math.ceil(size[0] / tile[0]);
    changedPins = [];
    // Regions go through more than a pixel, so they are fetched less often.
    pinsAt = performance.now() + (spectra.pins.some((p) => p.x1 !== undefined) ? 5000 : 1500);
    const touched = (x, y) => { const t = Math.floor(y / tile[1]) * columns + Math.floor(x / tile[0]); return ranges.some(([a, b]) => t >= a && t < b); };
    spectra.refresh((p) => (p.x1 === undefined ? touched(p.x, p.y) : true));
  }
}

function listen() {
  if (page.events) page.events.close();
  if (page.ended) return;
  const events = (page.events = new EventSource("/api/events"));
  events.addEventListener("state", (event) => hear(JSON.parse(event.data)));
  events.addEventListener("end", (event) => {
    page.ended = true;
    events.close();
    hear(JSON.parse(event.data)).then(() => picture.end());
  });
  events.addEventListener("error", () => page.ended || stage("gone"));
}
document.addEventListener("visibilitychange", () => {
  // Nobody looks: nothing is asked for.
  if (document.hidden) page.events?.close();
  else listen();
});
setInterval(() => picture.pump(), 200);
showControls();
listen();
