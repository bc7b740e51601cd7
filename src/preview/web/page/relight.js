// Light and paint: what each named spectrum of a factored cube is to be, for two choices A and B. The server makes pictures and spectra.

const SENT_AT_MOST = 1 << 20;
const asRendered = () => ({ first: { kind: "rendered" }, second: null, share: 0.5, scale: 1, same: true });
const element = (tag, more = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), more);
  made.append(...children);
  return made;
};

class Relight {
  // `changed` is called with the choices whose pictures are others now, or null where only A | B was switched.
  constructor(find, changed) {
    this.find = find;
    this.changed = changed;
    this.what = null;
    this.shown = "a";
    this.forms = { a: {}, b: {} };
    this.temperatures = { a: {}, b: {} };
    this.files = {};
    this.said = { a: null, b: null };
    this.revisions = { a: 0, b: 0 };
    this.sending = { a: false, b: false };
    this.waiting = { a: false, b: false };
    for (const button of find("relight").querySelectorAll("[data-choice]")) button.addEventListener("click", () => this.show(button.dataset.choice));
    find("copy-choice").addEventListener("click", () => this.copy());
    find("reset-choice").addEventListener("click", () => this.reset());
    find("copy-command").addEventListener("click", () => this.copyCommand());
  }

  // Whether the cube can be relit; of one that cannot there is nothing to see.
  isThere() {
    return this.what !== null;
  }

  // Whether A and B are not the same.
  differs() {
    return this.isThere() && JSON.stringify(this.said.a.choice) !== JSON.stringify(this.said.b.choice);
  }

  other() {
    return this.shown === "a" ? "b" : "a";
  }

  // The server says which revisions its choices have; `revisions` is missing where nothing can be relit.
  async hear(revisions) {
    this.heard = revisions;
    const known = this.isThere() && ["a", "b"].every((which) => revisions?.[which] === this.revisions[which]);
    if (!revisions || known || this.asking || this.isBusy()) return;
    this.asking = true;
    try {
      const answer = await fetch("/api/relight");
      if (!answer.ok) throw new Error((await answer.json()).error);
      const what = await answer.json();
      // The own choices may have been made meanwhile.
      if (this.isBusy()) return;
      const isNew = !this.isThere(), same = (which) => JSON.stringify(what.choices[which].choice) === JSON.stringify(this.said[which].choice);
      const others = ["a", "b"].filter((which) => isNew || !same(which));
      this.what = what;
      for (const which of ["a", "b"]) this.revisions[which] = what.choices[which].revision;
      for (const which of others) this.take(which, what.choices[which]);
      this.find("relight").hidden = false;
      if (others.length) this.build();
      this.changed(others);
    } catch (error) {
      this.tell(error.message, true);
    } finally {
      this.asking = false;
    }
  }

  isBusy() {
    return ["a", "b"].some((which) => this.sending[which] || this.waiting[which]);
  }

  // A choice of the server as forms.
  take(which, said) {
    const { choice } = said, part = (name, spec) => {
      if (typeof spec === "number") return { kind: "constant", value: spec };
      if (typeof spec === "string") return this.isOwn(name, spec);
      const rest = Object.keys(spec).filter((key) => key !== "scale");
      if (rest.length === 1 && spec.named !== undefined) return this.isOwn(name, spec.named);
      if (rest.length === 1 && spec.illuminant !== undefined) return { kind: "illuminant", name: spec.illuminant };
      if (rest.length === 1 && spec.blackbody !== undefined) return { kind: "blackbody", kelvin: spec.blackbody };
      if (rest.length === 1 && spec.constant !== undefined) return { kind: "constant", value: spec.constant };
      if (spec.file !== undefined && rest.every((key) => ["file", "column"].includes(key))) return { kind: "file", file: spec.file, column: String(spec.column ?? "") };
      return { kind: "given", spec: Object.fromEntries(rest.map((key) => [key, spec[key]])) };
    };
    const isPart = (spec) => typeof spec !== "object" || spec.scale === undefined;
    Object.assign(this.files, choice.files);
    this.forms[which] = {};
    for (const [name, spec] of Object.entries(choice.spectra)) {
      const form = asRendered();
      const times = choice.luminances[name];
      form.same = times !== undefined;
      form.scale = times ?? (typeof spec === "object" ? spec.scale ?? 1 : 1);
      if (spec.mix && spec.mix.every((each) => isPart(each) && !each.mix)) {
        [form.first, form.second] = spec.mix.map((each) => part(name, each));
        form.share = spec.share ?? 0.5;
      } else form.first = part(name, spec);
      this.forms[which][name] = form;
    }
    this.temperatures[which] = { ...choice.temperatures };
    this.said[which] = said;
  }

  isOwn(name, other) {
    return other === name ? { kind: "rendered" } : { kind: "named", name: other };
  }

  // What is sent of a choice.
  choice(which) {
    const part = (name, p) => ({
      rendered: () => ({ named: name }), named: () => ({ named: p.name }), illuminant: () => ({ illuminant: p.name }),
      blackbody: () => ({ blackbody: p.kelvin }), constant: () => ({ constant: p.value }), given: () => p.spec,
      file: () => ({ file: p.file, ...(p.column ? { column: /^\d+$/.test(p.column) ? Number(p.column) : p.column } : {}) }),
    })[p.kind]();
    const isReady = (p) => !p || p.kind !== "file" || p.file;
    const spectra = {}, luminances = {}, used = new Set();
    for (const [name, form] of Object.entries(this.forms[which])) {
      const { first, second, share, scale, same } = form;
      // Before a file is there nothing changes.
      if (!isReady(first) || !isReady(second)) continue;
      if (!second && first.kind === "rendered" && scale === 1) continue;
      const spec = second ? { mix: [part(name, first), part(name, second)], share } : part(name, first);
      if (this.keepsLuminance(name, form)) luminances[name] = scale;
      else spec.scale = scale;
      spectra[name] = spec;
      for (const p of [first, second]) if (p?.kind === "file") used.add(p.file);
    }
    const files = Object.fromEntries([...used].map((name) => [name, this.files[name]]));
    return { spectra, luminances, temperatures: this.temperatures[which], files };
  }

  // Light whose luminance stays that of the render, times the scale.
  keepsLuminance(name, form) {
    const { light, luminance } = this.what.spectra.find((spectrum) => spectrum.name === name) || {};
    const isRendered = form.first.kind === "rendered" && !form.second;
    return Boolean(light && luminance > 0 && form.same && !isRendered);
  }

  // One request at a time for each choice, and the latest state next.
  async send(which) {
    this.waiting[which] = true;
    if (this.sending[which]) return;
    this.sending[which] = true;
    while (this.waiting[which]) {
      this.waiting[which] = false;
      try {
        const body = JSON.stringify(this.choice(which));
        if (new TextEncoder().encode(body).length > SENT_AT_MOST) throw new Error("a choice has 1 MiB at most, files included");
        const answer = await fetch(`/api/relight/${which}`, { method: "PUT", body });
        const said = await answer.json();
        if (!answer.ok) throw new Error(said.error);
        this.said[which] = said;
        this.revisions[which] = said.revision;
        this.failed = null;
        this.changed([which]);
      } catch (error) {
        this.failed = error.message;
      }
      this.showSaid();
    }
    this.sending[which] = false;
    this.hear(this.heard);
  }

  show(which) {
    this.shown = which;
    this.failed = null;
    this.build();
    this.changed(null);
  }

  copy() {
    const { shown } = this, other = this.other();
    this.forms[other] = structuredClone(this.forms[shown]);
    this.temperatures[other] = { ...this.temperatures[shown] };
    return this.send(other);
  }

  reset() {
    this.forms[this.shown] = {};
    this.temperatures[this.shown] = {};
    this.build();
    return this.send(this.shown);
  }

  async copyCommand() {
    const text = this.find("relight-command").textContent;
    try {
      await navigator.clipboard.writeText(text);
      this.tell("The command line is copied.");
    } catch {
      getSelection().selectAllChildren(this.find("relight-command"));
      this.tell("The command line is marked: copy it.");
    }
  }

  tell(text, isWrong = false) {
    const said = this.find("relight-said");
    said.textContent = text;
    said.classList.toggle("wrong", isWrong);
    said.hidden = !text;
  }

  showSaid() {
    const said = this.said[this.shown];
    this.tell(this.failed ?? said.warnings.join("\n"), Boolean(this.failed));
    this.find("relight-command").textContent = said.command;
    const { bytes, most_bytes: most } = this.what;
    this.find("relight-slow").hidden = bytes < most * 0.9;
  }

  // The panel, anew.
  build() {
    const { find, what, shown } = this;
    for (const button of find("relight").querySelectorAll("[data-choice]")) button.setAttribute("aria-checked", String(button.dataset.choice === shown));
    find("copy-choice").textContent = `Copy ${shown.toUpperCase()} to ${this.other().toUpperCase()}`;
    find("reset-choice").textContent = `Reset ${shown.toUpperCase()}`;
    const rows = what.spectra.map((spectrum) => this.row(spectrum));
    const hot = what.temperatures.map((of) => this.temperature(of));
    find("relight-rows").replaceChildren(...rows, ...hot);
    const fixed = what.not_changed.length ? ` In nothing else are the spectra ${what.not_changed.join(", ")}.` : "";
    const share = what.remainder_share ? ` (${what.remainder_share})` : "";
    find("relight-fixed").textContent = what.remainder.length
      ? `As it was rendered stays what comes by ${what.remainder.join(", ")}${share}.${fixed}` : "";
    this.showSaid();
  }

  row(spectrum) {
    const { name } = spectrum, { shown } = this;
    const form = () => (this.forms[shown][name] ||= asRendered());
    const now = this.forms[shown][name] || asRendered();
    const send = () => this.send(shown);
    const again = () => { this.build(); this.find("relight-rows").querySelector(`[data-name="${CSS.escape(name)}"] [data-key="${this.focused}"]`)?.focus(); };
    const row = element("fieldset");
    row.dataset.name = name;
    row.append(element("legend", { textContent: name }, element("span", { className: "hint", textContent: `${spectrum.light ? "source" : "surface"}, ${spectrum.rendered}` })));

    const part = (which, label) => {
      const p = now[which];
      const line = element("div", { className: "bar" });
      const select = this.menu(spectrum, p, which === "second");
      select.dataset.key = which;
      select.setAttribute("aria-label", `${name}: ${label}`);
      select.addEventListener("change", () => {
        const [kind, of] = select.value.split(/:(.*)/s);
        const made = { rendered: { kind }, named: { kind, name: of }, illuminant: { kind, name: of }, blackbody: { kind, kelvin: 3000 },
          constant: { kind, value: spectrum.light ? 0 : 0.5 }, file: { kind, file: "", column: "" }, given: p }[kind] ?? null;
        form()[which] = made;
        this.focused = which;
        again();
        send();
      });
      line.append(element("label", {}, `${label} `, select));
      if (p?.kind === "blackbody") line.append(this.number(name, "K", p.kelvin, { min: 1, step: 100 }, (v) => { form()[which].kelvin = v; send(); }));
      if (p?.kind === "constant") line.append(this.number(name, "value", p.value, { min: 0, step: 0.05 }, (v) => { form()[which].value = v; send(); }));
      if (p?.kind === "file") {
        const input = element("input", { type: "file", accept: ".csv,.txt,.spd,text/csv,text/plain" });
        input.setAttribute("aria-label", `${name}: file of ${label}`);
        input.addEventListener("change", () => input.files[0] && this.drop(form(), which, input.files[0]).then(again).then(send));
        const column = element("input", { type: "text", value: p.column, size: 8, placeholder: "column", title: "Which column of the file, by name or number, where it has several" });
        column.setAttribute("aria-label", `${name}: column of the file`);
        column.addEventListener("change", () => { form()[which].column = column.value.trim(); send(); });
        line.append(input, element("output", { textContent: p.file || "or drop it here" }), column);
      }
      return line;
    };
    row.append(part("first", "is"));

    // A logarithmic slider, from a thousandth to a thousand, and a number.
    const slider = element("input", { type: "range", min: -3, max: 3, step: 0.01, value: Math.log10(Math.max(now.scale, 1e-3)), title: "Times, on a logarithmic scale" });
    slider.setAttribute("aria-label", `${name}: scale, logarithmic`);
    const scale = this.number(name, "×", now.scale, { min: 0, step: "any" }, (v) => { slider.value = Math.log10(Math.max(v, 1e-3)); form().scale = v; send(); });
    slider.addEventListener("input", () => {
      const v = Number((10 ** slider.valueAsNumber).toPrecision(3));
      scale.querySelector("input").value = v;
      form().scale = v;
      send();
    });
    const line = element("div", { className: "bar" }, scale, slider);
    if (spectrum.light) {
      const same = element("input", { type: "checkbox", checked: now.same && spectrum.luminance > 0, disabled: !(spectrum.luminance > 0) });
      same.addEventListener("change", () => { form().same = same.checked; send(); });
      const title = spectrum.luminance > 0 ? "The scale counts from the luminance that was rendered" : "It was rendered without luminance";
      line.append(element("label", { title }, same, " of its luminance"));
    }
    row.append(line);

    row.append(part("second", "mixed with"));
    if (now.second) {
      const share = element("input", { type: "range", min: 0, max: 1, step: 0.01, value: now.share, title: "Share of the second" });
      share.setAttribute("aria-label", `${name}: share of the second`);
      const number = this.number(name, "share", now.share, { min: 0, max: 1, step: 0.01 }, (v) => { share.value = v; form().share = v; send(); });
      share.addEventListener("input", () => {
        number.querySelector("input").value = share.value;
        form().share = share.valueAsNumber;
        send();
      });
      row.append(element("div", { className: "bar" }, number, share));
    }
    row.addEventListener("dragover", (event) => { event.preventDefault(); row.classList.add("over"); });
    row.addEventListener("dragleave", () => row.classList.remove("over"));
    row.addEventListener("drop", (event) => {
      event.preventDefault();
      row.classList.remove("over");
      const file = event.dataTransfer.files[0];
      if (file) this.drop(form(), "first", file).then(again).then(send);
    });
    return row;
  }

  temperature({ material, kelvin }) {
    const { shown } = this;
    const row = element("fieldset", {}, element("legend", { textContent: material }, element("span", { className: "hint", textContent: `heat, ${kelvin} K` })));
    row.append(this.number(material, "K", this.temperatures[shown][material] ?? kelvin, { min: 1, step: 1 }, (v) => {
      if (v === kelvin) delete this.temperatures[shown][material];
      else this.temperatures[shown][material] = v;
      this.send(shown);
    }));
    return row;
  }

  number(name, label, value, more, take) {
    const input = element("input", { type: "number", ...more });
    input.value = value;
    input.setAttribute("aria-label", `${name}: ${label}`);
    input.addEventListener("input", () => {
      const v = input.valueAsNumber;
      if (isFinite(v) && v >= (more.min ?? -Infinity) && v <= (more.max ?? Infinity)) take(v);
    });
    return element("label", {}, `${label} `, input);
  }

  // What it may be.
  menu(spectrum, part, mayBeNone) {
    const { what } = this, select = element("select");
    const add = (parent, value, text) => parent.append(element("option", { value, textContent: text }));
    if (mayBeNone) add(select, "none", "nothing");
    add(select, "rendered", "as rendered");
    if (part?.kind === "given") add(select, "given", "as a script has it");
    const others = what.spectra.filter((other) => other.name !== spectrum.name && other.light === spectrum.light);
    const group = (label) => { const made = element("optgroup", { label }); select.append(made); return made; };
    if (others.length) {
      const parent = group("of the scene");
      for (const { name } of others) add(parent, `named:${name}`, name);
    }
    if (spectrum.light) {
      const parent = group("illuminants of the CIE");
      for (const name of what.illuminants) add(parent, `illuminant:${name}`, name);
      add(select, "blackbody", "a black body");
    }
    add(select, "constant", "the same everywhere");
    add(select, "file", "a file (CSV)");
    const value = !part ? "none" : part.kind === "named" || part.kind === "illuminant" ? `${part.kind}:${part.name}` : part.kind;
    select.value = value;
    return select;
  }

  // Takes a file; two that differ do not share a name.
  async drop(form, which, file) {
    const text = await file.text();
    let name = file.name;
    for (let i = 2; this.files[name] !== undefined && this.files[name] !== text; i++) name = `${i}-${file.name}`;
    this.files[name] = text;
    form[which] = { kind: "file", file: name, column: form[which]?.column ?? "" };
  }
}
