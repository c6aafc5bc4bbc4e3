// Browsers refuse workers to pages that are opened from the disk: there the search runs in a hidden frame.
if (location.protocol === "file:") {
  const copied = data => ({ data: structuredClone(data) });
  window.Worker = class {
    constructor(url) {
      this.frame = document.body.appendChild(document.createElement("iframe"));
      this.frame.hidden = true;
      const inside = this.frame.contentWindow;
      inside.postMessage = data => setTimeout(() => this.onmessage?.(copied(data)));
      const script = inside.document.createElement("script");
      script.src = url;
      script.onerror = event => this.onerror?.(event);
      this.loaded = new Promise(resolve => (script.onload = resolve));
      inside.document.head.append(script);
    }
    postMessage(data) {
      this.loaded.then(() => this.frame.contentWindow.onmessage(copied(data)));
    }
    terminate() {
      this.frame.remove();
    }
  };
}
