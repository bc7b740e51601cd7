// Drives the page as somebody who looks at it would, and prints what it saw as one JSON object.
//   node drive.mjs render|view|heat|relight URL X Y [FOLDER FOR SCREENSHOTS]

import fs from "node:fs";
import { open } from "./browser.mjs";

const [what, url, x, y, shots] = process.argv.slice(2);
const browser = await open(url);
const { page } = browser;
const seen = { complaints: browser.complaints, elsewhere: browser.elsewhere };

// Tenths of a second after which nothing comes any more, on however busy a machine.
const PATIENCE = 1200;

const shot = async (name) => shots && (await page.screenshot({ path: `${shots}/${name}.png` }));
const stage = () => page.locator("#stage").getAttribute("data-stage");
const becomes = (wanted) => page.waitForFunction((wanted) => document.getElementById("stage").dataset.stage === wanted, wanted);
const change = async (act) => {
  const before = await browser.look();
  await act();
  let after = before;
  for (let i = 0; i < PATIENCE && after.hash === before.hash; i++) {
    await page.waitForTimeout(100);
    await browser.settled();
    after = await browser.look();
  }
  return { changed: before.hash !== after.hash, before: before.mean, after: after.mean };
};
const download = async (act) => {
  const [file] = await Promise.all([page.waitForEvent("download"), act()]);
  return { name: file.suggestedFilename(), text: fs.readFileSync(await file.path(), "utf8") };
};

// The largest difference between the picture as the page makes it and as the server does.
const against_png = () => page.evaluate(async () => {
  const { picture } = window.spectile, { tone, show } = picture;
  const [square] = picture.inSight(picture.scales().base, [0, 0, ...picture.cube.size]), [x0, y0, x1, y1] = square.rect;
  const shown = ["temperature", "samples", "difference"].includes(show.mode) ? `low=${tone.low}&high=${tone.high}` : `ev=${tone.ev}`;
  const url = `/api/image?${square.what}&x0=${x0}&y0=${y0}&x1=${x1}&y1=${y1}&scale=${square.scale}&${shown}`;
  const bitmap = await createImageBitmap(await (await fetch(url)).blob());
  const { width, height } = square.canvas, copy = new OffscreenCanvas(width, height).getContext("2d");
  copy.drawImage(bitmap, 0, 0);
  const [server, own] = [copy, square.canvas.getContext("2d")].map((c) => c.getImageData(0, 0, width, height).data);
  return own.reduce((most, v, i) => Math.max(most, Math.abs(v - server[i])), square.look === picture.look ? 0 : 999);
});

await page.waitForFunction(() => window.spectile.picture.drawn > 0);
seen.first_picture_ms = Date.now() - browser.began;
await browser.settled();
seen.start = await browser.look();
// On a busy machine a render's first tile may come after the empty picture has been drawn.
for (let i = 0; i < PATIENCE && seen.start.colours <= 20; i++) {
  await page.waitForTimeout(100);
  seen.start = await browser.look();
}
seen.title = await page.title();
seen.panel = await page.locator("#relight").isVisible();
if (what === "view") seen.against_png = await against_png();

if (what === "render") {
  // It fills in by itself.
  const first = seen.start.hash;
  for (let i = 0; i < PATIENCE && !seen.updates; i++) {
    await page.waitForTimeout(100);
    seen.updates = (await browser.look()).hash !== first;
  }
  await page.waitForFunction(() => window.spectile.progress.curve.length >= 3);
  seen.curve = await page.evaluate(() => ({ points: window.spectile.progress.curve.length, drawn: !!window.spectile.progress.plot }));
  seen.devices = await page.locator("#devices tbody tr").count();
  await page.locator("#pause").click();
  await becomes("paused");
  // What is under way when the pause begins still comes.
  const paths = () => page.evaluate(() => window.spectile.page.state.paths);
  const atRest = async () => {
    let before = -1, now = await paths();
    for (let i = 0; i < PATIENCE / 10 && before !== now; i++) {
      await page.waitForTimeout(1000);
      [before, now] = [now, await paths()];
    }
    seen.rests = before === now;
    return now;
  };
  const rests = await atRest();
  await page.locator("#picture").focus();
  await page.keyboard.press(" ");
  await becomes("rendering");
  await page.waitForFunction((rests) => window.spectile.page.state.paths > rests, rests);
  await page.keyboard.press(" ");
  await becomes("paused");
  await atRest();
  await page.locator("#save").click();
}

if (what === "relight") {
  await page.waitForFunction(() => window.spectile.relight.isThere());
  seen.panel = await page.locator("#relight").isVisible();
  seen.rows = await page.locator("#relight-rows legend").evaluateAll((all) => all.map((legend) => legend.firstChild.textContent));
  await page.mouse.click(...(await browser.at(Number(x), Number(y))));
  await page.waitForFunction(() => window.spectile.spectra.pins.length === 1);
  // What the page holds of the pinned pixel, once the server has what was chosen and all is drawn.
  const settles = async () => {
    await page.waitForFunction(() => { const { relight, spectra } = window.spectile; return !relight.isBusy() && !spectra.refreshing; });
    await browser.settled();
  };
  const pinned = async () => {
    await settles();
    return page.evaluate(() => { const { radiance, other, difference } = window.spectile.spectra.pins[0]; return { radiance, other, difference, series: window.spectile.spectra.plot.series.length - 1 }; });
  };
  const row = (name) => page.locator(`[data-name="${name}"]`);
  seen.before = await pinned();
  await page.locator('[data-choice="b"]').click();
  seen.illuminant = await change(() => row("desk lamp").locator('[data-key="first"]').selectOption("illuminant:FL11"));
  seen.under_illuminant = await pinned();
  seen.scaled = await change(() => page.getByLabel("desk lamp: ×").fill("0.25"));
  seen.under_scaled = await pinned();
  seen.mixed = await change(async () => {
    await row("desk lamp").locator('[data-key="second"]').selectOption("rendered");
    const share = page.getByLabel("desk lamp: share of the second");
    await share.focus();
    for (let i = 0; i < 5; i++) await page.keyboard.press("ArrowRight");
  });
  seen.dropped = await change(async () => {
    const data = await page.evaluateHandle(() => {
      const data = new DataTransfer();
      data.items.add(new File(["nm,r\n400,0.9\n700,0.1\n"], "paint.csv", { type: "text/csv" }));
      return data;
    });
    await page.dispatchEvent('[data-name="paint"]', "drop", { dataTransfer: data });
  });
  seen.under_dropped = await pinned();
  await shot("relight");
  seen.command = await page.locator("#relight-command").textContent();
  seen.sets = await page.evaluate(() => window.spectile.relight.said.b.sets);
  // What is wrong is told, and nothing changes.
  await row("grey").locator('[data-key="first"]').selectOption("constant");
  await settles();
  await page.getByLabel("grey: value").fill("1.5");
  await page.waitForFunction(() => document.getElementById("relight-said").classList.contains("wrong"));
  seen.wrong = await page.locator("#relight-said").textContent();
  // The browser tells of the answer, too.
  seen.refusals = browser.complaints.splice(0);
  await row("grey").locator('[data-key="first"]').selectOption("rendered");
  await settles();
  // Between both, and how far they are apart.
  await page.locator("#picture").focus();
  seen.switched = await change(() => page.keyboard.press("x"));
  seen.shown = await page.evaluate(() => window.spectile.relight.shown);
  seen.difference = await change(() => page.keyboard.press("6"));
  await settles();
  await page.mouse.move(...(await browser.at(Number(x), Number(y))));
  await page.waitForFunction(() => document.getElementById("cursor").textContent.includes("ΔE 2000"));
  seen.cursor = await page.locator("#cursor").textContent();
  seen.list = await page.locator("#pins .value").textContent();
  seen.against_png = await against_png();
  await shot("relight-difference");
  // Beside another white.
  seen.white = await change(() => page.locator("#white").selectOption(`${x},${y}`));
  seen.under_white = await pinned();
  await page.locator("#white").selectOption("");
  await settles();
  // Copied, there is no difference.
  await page.locator("#copy-choice").click();
  await settles();
  seen.copied = await pinned();
  await page.locator("#picture").focus();
  await page.keyboard.press("1");
  await page.keyboard.press("Escape");
  await page.locator('[data-choice="a"]').click();
  await page.locator("#reset-choice").click();
  await settles();
  seen.end = await browser.look();
  // Whoever comes later sees what was chosen.
  await page.locator('[data-choice="b"]').click();
  await row("ceiling").locator('[data-key="first"]').selectOption("constant");
  await page.getByLabel("ceiling: value").fill("0.02");
  await settles();
  await page.reload();
  await page.waitForFunction(() => window.spectile.relight.isThere());
  seen.forms = await page.evaluate(() => window.spectile.relight.forms.b);
} else if (what === "heat") {
  // By itself: all channels are thermal.
  seen.opens_as = await page.evaluate(() => window.spectile.picture.show.mode);
  await browser.settled();
  await page.mouse.move(...(await browser.at(Number(x), Number(y))));
  await page.waitForFunction(() => document.getElementById("cursor").textContent.includes(" K"));
  seen.cursor = await page.locator("#cursor").textContent();
  seen.range = [await page.locator("#low").inputValue(), await page.locator("#high").inputValue()];
  seen.against_png = await against_png();
  await shot("heat");
  // Where the effort went.
  seen.samples = await change(() => page.keyboard.press("5"));
  await browser.settled();
  await page.mouse.move(...(await browser.at(Number(x) + 1, Number(y))));
  await page.waitForFunction(() => document.getElementById("cursor").textContent.endsWith(" samples"));
  seen.samples_cursor = await page.locator("#cursor").textContent();
  seen.samples_range = [await page.locator("#low").inputValue(), await page.locator("#high").inputValue()].map(Number);
  seen.samples_against_png = await against_png();
  await shot("samples");
} else {
  // A click pins a pixel; its spectrum can be had as a file.
  await page.mouse.click(...(await browser.at(Number(x), Number(y))));
  await page.waitForFunction(() => window.spectile.spectra.pins.length === 1);
  seen.pin = await page.evaluate(() => {
    const { x, y, samples } = window.spectile.spectra.pins[0];
    return { x, y, samples, bands: window.spectile.spectra.plot.bands.length, plotted: window.spectile.spectra.plot.data[1].some((v) => v !== null) };
  });
  seen.csv = await download(() => page.locator("#csv").click());
  // The same by keys: the cursor begins where the pointer was.
  await page.mouse.move(...(await browser.at(Number(x), Number(y))));
  await page.locator("#picture").focus();
  await page.keyboard.press("ArrowRight");
  await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => window.spectile.spectra.pins.length === 2);
  // A region.
  const [a, b] = [await browser.at(3, 4), await browser.at(8, 6)];
  await page.keyboard.down("Shift");
  await page.mouse.move(...a);
  await page.mouse.down();
  await page.mouse.move(...b, { steps: 4 });
  await page.mouse.up();
  await page.keyboard.up("Shift");
  await page.waitForFunction(() => window.spectile.spectra.pins.length === 3);
  seen.pins = await page.evaluate(() => window.spectile.spectra.pins.map(({ x, y, x1, y1, pixels, radiance }) => ({ x, y, x1, y1, pixels, radiance })));
  seen.all_csv = (await download(() => page.keyboard.press("c"))).text;
  await shot(`${what}-spectra`);

  // Other pictures of it.
  seen.brighter = await change(() => page.keyboard.press("E"));
  seen.automatic = await change(() => page.keyboard.press("a"));
  seen.channel = await change(() => page.keyboard.press("2"));
  const name = () => page.locator("#channel-name").textContent();
  const before = await name();
  seen.slider = await change(async () => {
    await page.locator("#channel").focus();
    for (let i = 0; i < 3; i++) await page.keyboard.press("ArrowRight");
  });
  seen.slider.label = before !== (await name());
  const stepped = await name();
  seen.step = await change(() => page.keyboard.press(","));
  await page.keyboard.press(".");
  seen.step_back = stepped === (await name());
  await page.keyboard.press(",");
  await shot(`${what}-channel`);
  if (what === "view") seen.channel_against_png = await against_png();
  seen.false_colour = await change(() => page.keyboard.press("3"));
  seen.closer = await change(async () => {
    await page.mouse.move(...(await browser.at(Number(x), Number(y))));
    await page.mouse.wheel(0, -480);
  });
  seen.fit = await change(() => page.keyboard.press("0"));
  const zoom = () => page.evaluate(() => window.spectile.picture.zoom);
  seen.zooms = [await zoom()];
  for (const key of ["+", "-", "9", "0"]) {
    await page.keyboard.press(key);
    seen.zooms.push(await zoom());
  }
  const background = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
  seen.themes = [await background()];
  await page.locator("#theme").click();
  seen.themes.push(await background());
  await shot(`${what}-dark`);
  await page.locator("#theme").click();
  await page.locator("#picture").focus();
  await page.keyboard.press("1");
  await page.keyboard.press("Escape");
  seen.pins_left = await page.evaluate(() => window.spectile.spectra.pins.length);
  await page.keyboard.press("?");
  seen.help = await page.locator("#keys").isVisible();
  await page.keyboard.press("Escape");
}

if (what === "render") {
  // While it rests: so the cube that is left is the one that was looked at.
  page.on("dialog", (dialog) => dialog.accept());
  await page.locator("#stop").click();
  await becomes("stopped");
}
seen.stage = await stage();
await browser.close();
console.log(JSON.stringify(seen));
