// A headless Chromium driven over its debugging pipe: no package needed.

import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const FLAGS = [
  '--headless', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync', '--disable-dev-shm-usage', '--hide-scrollbars',
  '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--remote-debugging-pipe',
];
const ERROR_TYPES = ['error', 'assert'];

export class Browser {
  #process;
  #profile = mkdtempSync(join(tmpdir(), 'arex-browser-'));
  #calls = new Map();
  #listeners = [];
  #number = 0;
  #text = '';

  constructor(program) {
    const flags = [...FLAGS, `--user-data-dir=${this.#profile}`];
    this.#process = spawn(program, flags, { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
    this.#process.on('exit', (code) => this.#fail(new Error(`the browser ended with ${code}`)));
    this.#process.stdio[3].on('error', (error) => this.#fail(error));
    this.#process.stdio[4].on('error', (error) => this.#fail(error));
    this.#process.stdio[4].on('data', (data) => this.#read(data));
  }

  #fail(error) {
    for (const { reject } of this.#calls.values()) reject(error);
    this.#calls.clear();
  }

  #read(data) {
    this.#text += data;
    for (let end = this.#text.indexOf('\0'); end >= 0; end = this.#text.indexOf('\0')) {
      const message = JSON.parse(this.#text.slice(0, end));
      this.#text = this.#text.slice(end + 1);
      const call = this.#calls.get(message.id);
      if (!call) this.#listeners.forEach((listener) => listener(message));
      else if (message.error) call.reject(new Error(`${call.method}: ${message.error.message}`));
      else call.resolve(message.result);
      this.#calls.delete(message.id);
    }
  }

  call(method, params = {}, sessionId = undefined) {
    const id = ++this.#number;
    return new Promise((resolve, reject) => {
      this.#calls.set(id, { method, resolve, reject });
      this.#process.stdio[3].write(JSON.stringify({ id, method, params, sessionId }) + '\0');
    });
  }

  listen(listener) {
    this.#listeners.push(listener);
  }

  async open(url, options) {
    const { targetId } = await this.call('Target.createTarget', { url: 'about:blank' });
    const { sessionId } = await this.call('Target.attachToTarget', { targetId, flatten: true });
    const page = new Page(this, sessionId, targetId);
    await page.load(url, options);
    return page;
  }

  async close() {
    const ended = new Promise((resolve) => this.#process.once('exit', resolve));
    await this.call('Browser.close').catch(() => {});
    await ended;
    rmSync(this.#profile, { recursive: true, force: true, maxRetries: 10, retryDelay: 100 });
  }
}

class Page {
  /** What the console, exceptions and the browser itself complained of. */
  complaints = [];
  /** Every address that the page asked for. */
  requests = [];

  constructor(browser, session, target) {
    this.browser = browser;
    this.session = session;
    this.target = target;
    browser.listen(({ sessionId, method, params }) => {
      if (sessionId !== session) return;
      if (method === 'Runtime.exceptionThrown') {
        const details = params.exceptionDetails;
        this.complaints.push(details.exception?.description ?? details.text);
      } else if (method === 'Runtime.consoleAPICalled' && ERROR_TYPES.includes(params.type)) {
        this.complaints.push(params.args.map((arg) => arg.value ?? arg.description).join(' '));
      } else if (method === 'Log.entryAdded' && params.entry.level === 'error') {
        this.complaints.push(params.entry.text);
      } else if (method === 'Network.requestWillBeSent') {
        this.requests.push(params.request.url);
      }
    });
  }

  call(method, params) {
    return this.browser.call(method, params, this.session);
  }

  async load(url, { width = 1280, dark = false, script = true, before = '' } = {}) {
    this.scripted = script;
    for (const domain of ['Runtime', 'Log', 'Page', 'Network']) await this.call(`${domain}.enable`);
    const size = { width, height: 900, deviceScaleFactor: 1, mobile: width < 600 };
    await this.call('Emulation.setDeviceMetricsOverride', size);
    const value = dark ? 'dark' : 'light';
    await this.call('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value }] });
    if (!script) await this.call('Emulation.setScriptExecutionDisabled', { value: true });
    if (before) await this.call('Page.addScriptToEvaluateOnNewDocument', { source: before });
    await this.call('Page.navigate', { url });
    const done = script
      ? `document.documentElement?.dataset.ready === 'yes'`
      : `document.readyState === 'complete' && location.href !== 'about:blank'`;
    await this.until(done);
    await this.settle();
  }

  async run(expression) {
    const answer = await this.call('Runtime.evaluate', { expression, returnByValue: true, awaitPromise: true });
    if (answer.exceptionDetails) throw new Error(answer.exceptionDetails.exception?.description ?? expression);
    return answer.result.value;
  }

  async until(expression, seconds = 60) {
    const end = Date.now() + 1000 * seconds;
    while (!(await this.run(expression))) {
      if (Date.now() > end) throw new Error(`never true: ${expression}; ${this.complaints.join('; ')}`);
      await new Promise((resolve) => setTimeout(resolve, 50));
    }
  }

  /** Two frames: what was asked to be drawn is drawn. Without a script, frames cannot be counted. */
  settle() {
    if (!this.scripted) return new Promise((resolve) => setTimeout(resolve, 200));
    return this.run(`new Promise((r) => requestAnimationFrame(() => requestAnimationFrame(() => r(0))))`);
  }

  /** Presses the mouse where a share of an element's width is. */
  async click(selector, share = 0.5) {
    await this.run(`document.querySelector(${JSON.stringify(selector)}).scrollIntoView({block: 'center'})`);
    const [x, y, width, height] = await this.run(
      `(({x, y, width, height}) => [x, y, width, height])(document.querySelector(${JSON.stringify(selector)})` +
        `.getBoundingClientRect())`,
    );
    const at = { x: x + share * width, y: y + height / 2, button: 'left', clickCount: 1 };
    await this.call('Input.dispatchMouseEvent', { type: 'mousePressed', ...at });
    await this.call('Input.dispatchMouseEvent', { type: 'mouseReleased', ...at });
    await this.settle();
  }

  /** Pixels of a canvas that are not its first one's colour, and a sum over all that tells pictures apart. */
  picture(selector) {
    return this.run(`(() => {
      const from = document.querySelector(${JSON.stringify(selector)});
      const copy = document.createElement('canvas');
      copy.width = from.width;
      copy.height = from.height;
      const context = copy.getContext('2d');
      context.drawImage(from, 0, 0);
      const pixels = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
      let drawn = 0, sum = 0;
      for (let i = 0; i < pixels.length; ++i) {
        if (pixels[i] !== pixels[0]) ++drawn;
        sum = (Math.imul(sum, 31) + pixels[i]) >>> 0;
      }
      return { share: drawn / pixels.length, drawn, sum };
    })()`);
  }

  async screenshot() {
    const { data } = await this.call('Page.captureScreenshot', { captureBeyondViewport: true });
    return Buffer.from(data, 'base64');
  }

  async pdf() {
    const { data } = await this.call('Page.printToPDF', { printBackground: false });
    return Buffer.from(data, 'base64');
  }

  close() {
    return this.browser.call('Target.closeTarget', { targetId: this.target });
  }
}
