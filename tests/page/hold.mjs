// Keeps the page open, as somebody who watches does, until standard input ends: node hold.mjs URL
import { open } from "./browser.mjs";

const { page, close } = await open(process.argv[2]);
await page.waitForFunction(() => window.spectile.picture.drawn > 0).catch(() => {});
console.log("open");
process.stdin.resume();
process.stdin.on("end", () => close().finally(() => process.exit(0)));
