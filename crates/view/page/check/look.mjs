// Saves a screenshot of a page: node crates/view/page/check/look.mjs URL FILE.png [WIDTHxHEIGHT] [dark] [SCRIPT]

import { writeFileSync } from 'node:fs';
import { Browser } from './browser.mjs';

const [url, file, size = '1280x720', theme = 'light', script] = process.argv.slice(2);
const [width, height] = size.split('x').map(Number);
const browser = new Browser(undefined, [width, height]);
try {
  await browser.open('about:blank');
  await browser.size(width, height, theme === 'dark');
  await browser.open(url);
  await browser.ready(180);
  if (script) {
    await browser.value(script);
    await new Promise((resolve) => setTimeout(resolve, 500));
    await browser.ready(180);
  }
  writeFileSync(file, await browser.picture());
  const printed = await browser.value('JSON.stringify({ first: voxtile.firstPictureMs, faces: voxtile.faces(), calls: voxtile.drawCalls(), bytes: voxtile.bytes(), message: document.getElementById("message").textContent })');
  console.log(printed, browser.errors.join('\n'));
} catch (error) {
  console.log(error.message, browser.errors.join('\n'));
  writeFileSync(file, await browser.picture());
  process.exitCode = 1;
} finally {
  await browser.close();
}
