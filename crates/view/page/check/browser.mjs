// Headless Chromium, controlled by its DevTools protocol over a pipe, without packages.

import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const FLAGS = ['--headless=new', '--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
  '--disable-background-networking', '--no-first-run', '--remote-debugging-pipe'];

export class Browser {
  constructor(program = process.env.CHROMIUM ?? 'chromium', size = [960, 640]) {
    this.profile = mkdtempSync(join(tmpdir(), 'voxtile-browser-'));
    this.process = spawn(program, [...FLAGS, `--user-data-dir=${this.profile}`, `--window-size=${size}`, 'about:blank'],
      { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.waiting = new Map();
    this.number = 0;
    this.errors = [];
    // Receives all messages.
    this.listener = null;
    let rest = '';
    this.process.stdio[4].on('data', (data) => {
      const parts = (rest + data).split('\0');
      rest = parts.pop();
      parts.map((part) => JSON.parse(part)).forEach((message) => this.take(message));
    });
  }

  take(message) {
    if (message.method === 'Runtime.exceptionThrown') {
      const { text, exception } = message.params.exceptionDetails;
      this.errors.push(exception?.description ?? text);
    }
    if (message.method === 'Log.entryAdded' && message.params.entry.level === 'error') {
      const { text, url } = message.params.entry;
      this.errors.push(`${text} ${url ?? ''}`);
    }
    this.listener?.(message);
    const waits = this.waiting.get(message.id);
    if (!waits) return;
    this.waiting.delete(message.id);
    if (message.error) waits[1](new Error(message.error.message));
    else waits[0](message.result);
  }

  call(method, params = {}, session = this.session) {
    const id = ++this.number;
    const sent = new Promise((resolve, reject) => this.waiting.set(id, [resolve, reject]));
    this.process.stdio[3].write(JSON.stringify({ id, method, params, sessionId: session }) + '\0');
    return sent;
  }

  async open(url) {
    if (!this.session) {
      // Open a new tab, because Chromium may replace its first one.
      const { targetId } = await this.call('Target.createTarget', { url: 'about:blank' }, undefined);
      ({ sessionId: this.session } = await this.call('Target.attachToTarget', { targetId, flatten: true }, undefined));
      for (const domain of ['Page', 'Runtime', 'Log']) await this.call(`${domain}.enable`);
    }
    await this.call('Page.navigate', { url });
  }

  async size(width, height, dark = false) {
    await this.call('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: width < 500 });
    await this.call('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }] });
  }

  // Returns the value of an expression, or of its promise, in the page.
  async value(expression) {
    const { result, exceptionDetails } = await this.call('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
    if (exceptionDetails) throw new Error(`${expression}: ${exceptionDetails.exception?.description ?? exceptionDetails.text}`);
    return result.value;
  }

  // Waits until an expression holds in the page.
  async until(expression, seconds = 120) {
    const since = Date.now();
    for (;;) {
      const value = await this.value(expression).catch(() => null);
      if (value) return value;
      const hasFailed = await this.value('document.getElementById("state")?.textContent === "failed"').catch(() => false);
      if (hasFailed || Date.now() - since > 1000 * seconds) {
        const state = await this.value('document.getElementById("state").textContent + " " + document.getElementById("message").textContent').catch(() => '');
        throw new Error(`not within ${seconds} s: ${expression} (the page says: ${state}; ${this.errors.join('; ')})`);
      }
      await new Promise((resolve) => setTimeout(resolve, 100));
    }
  }

  ready(seconds) {
    return this.until('document.getElementById("state")?.textContent === "ready"', seconds);
  }

  async picture() {
    const { data } = await this.call('Page.captureScreenshot', { format: 'png' });
    return Buffer.from(data, 'base64');
  }

  async close() {
    const ended = new Promise((resolve) => this.process.once('exit', resolve));
    this.process.kill();
    await ended;
    try {
      rmSync(this.profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 200 });
    } catch {
      // Child processes of Chromium may still write to the profile folder. It is in the temporary folder, so the system
      // removes it later.
    }
  }
}
