// A real Chromium without a screen, and a page in it whose complaints are collected.

import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { chromium } from "playwright-core";

export async function open(url, { width = 1400, height = 860, dark = false } = {}) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), "spectile-browser-"));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.SPECTILE_CHROMIUM || "/usr/bin/chromium",
    headless: true,
    viewport: { width, height },
    colorScheme: dark ? "dark" : "light",
    acceptDownloads: true,
    timeout: 120_000,
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
      "--disable-component-update", "--disable-sync"],
  });
  const page = context.pages()[0] ?? (await context.newPage());
  page.setDefaultTimeout(120_000);
  // Errors of scripts and warnings of the browser, and whatever is asked of anybody else.
  const complaints = [], elsewhere = [];
  const own = new URL(url).host;
  page.on("console", (message) => ["error", "warning"].includes(message.type()) && complaints.push(message.text()));
  page.on("pageerror", (error) => complaints.push(String(error.stack || error)));
  page.on("request", (request) => {
    const asked = new URL(request.url());
    if (asked.protocol.startsWith("http") && asked.host !== own) elsewhere.push(asked.href);
  });
  const began = Date.now();
  await page.goto(url);
  return {
    page, complaints, elsewhere, began,
    close: async () => {
      await context.close();
      fs.rmSync(profile, { recursive: true, force: true });
    },
    // Where a pixel of the picture is in the window.
    at: (x, y) => page.evaluate(([x, y]) => {
      const picture = window.spectile.picture, box = picture.canvas.getBoundingClientRect();
      const [a, b] = picture.toCanvas([x + 0.5, y + 0.5]);
      return [box.left + a / devicePixelRatio, box.top + b / devicePixelRatio];
    }, [x, y]),
    // A number that tells what is on the canvas, its mean brightness, and how many colours it has.
    look: () => page.evaluate(() => {
      const { canvas } = window.spectile.picture, copy = new OffscreenCanvas(canvas.width, canvas.height);
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.drawImage(canvas, 0, 0);
      const { data } = context.getImageData(0, 0, copy.width, copy.height);
      let hash = 0, sum = 0;
      const colours = new Set();
      for (let i = 0; i < data.length; i += 4) {
        const colour = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
        hash = (Math.imul(hash, 31) + colour) | 0;
        sum += data[i] + data[i + 1] + data[i + 2];
        colours.add(colour);
      }
      return { hash, mean: sum / data.length, colours: colours.size };
    }),
    settled: () => page.waitForFunction(() => {
      const { picture } = window.spectile;
      return picture.drawn > 0 && !picture.loading && !picture.painting;
    }),
  };
}
