// Browsers start no worker of a page that was opened from a file. There its script runs in a hidden frame, so that the
// search works offline. MkDocs' theme would fetch such a part from another server.
if (location.protocol === "file:") window.Worker = class extends EventTarget {
  constructor(url) {
    super();
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    document.body.append(this.frame);
    const worker = this.worker = this.frame.contentWindow;
    this.ready = new Promise(ready => {
      const page = worker.document;
      page.open();
      page.write("<!DOCTYPE html><html><head></head><body></body></html>");
      page.close();
      const load = address => new Promise((done, failed) => {
        const script = page.createElement("script");
        Object.assign(script, {src: address, onload: done, onerror: failed});
        page.head.append(script);
      });
      worker.postMessage = data => this.dispatchEvent(new MessageEvent("message", {data}));
      worker.importScripts = (...addresses) => addresses.reduce((before, address) =>
        before.then(() => load(new URL(address, url).href)), Promise.resolve());
      worker.addEventListener("error", event => this.dispatchEvent(new ErrorEvent("error", {message: event.message})));
      load(url).then(ready, () => this.dispatchEvent(new ErrorEvent("error", {message: `cannot load ${url}`})));
    });
    this.addEventListener("message", event => this.onmessage && this.onmessage(event));
    this.addEventListener("error", event => this.onerror && this.onerror(event));
  }
  postMessage(data) { this.ready.then(() => this.worker.dispatchEvent(new MessageEvent("message", {data}))); }
  terminate() { this.frame.remove(); }
};
