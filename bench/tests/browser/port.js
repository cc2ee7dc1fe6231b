"use strict";
// A serial port that a test feeds: what it is given comes out of the port, and what the page writes is kept for it.

const fakePort = {
  isHeld: false,
  baudRate: 0,
  readable: null,
  writable: null,
  sent: [],
  async open({ baudRate }) {
    if (this.isHeld) throw new DOMException("Failed to open serial port.", "NetworkError");
    if (this.readable) throw new DOMException("The port is already open.", "InvalidStateError");
    this.baudRate = baudRate;
    this.readable = new ReadableStream({ start: (incoming) => (this.incoming = incoming) });
    this.writable = new WritableStream({ write: (bytes) => void this.sent.push(...bytes) });
  },
  async close() {
    if (this.readable?.locked || this.writable?.locked) throw new TypeError("a stream of the port is in use");
    this.readable = this.writable = null;
  },
  unplug() {
    this.readable = null;
    this.incoming.error(new DOMException("The device has been lost.", "NetworkError"));
  },
  // Bytes as characters, both ways.
  exchange(text) {
    if (text && this.readable) this.incoming.enqueue(Uint8Array.from(text, (character) => character.charCodeAt(0)));
    return String.fromCharCode(...this.sent.splice(0));
  },
};

Object.defineProperty(navigator, "serial", { value: { requestPort: async () => fakePort } });
