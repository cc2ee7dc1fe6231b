"use strict";
// A connection to a machine: the bytes of a serial port. What they mean is the WebAssembly module's business.

const BAUD = 921600;
// Longest wait for an answer, ms, and for that of storing settings, which erases flash.
const ANSWER_MS = 3000;
const STORED_MS = 8000;

class Link {
  // `heard` has the functions `event`, `log`, `samples`, `restarted` and `lost`.
  constructor(module, port, heard) {
    Object.assign(this, { module, port, heard });
    this.waiting = new Map();
    this.isOpen = false;
    this.answeredAt = performance.now();
  }

  async open() {
    await this.port.open({ baudRate: BAUD, bufferSize: 1 << 16 });
    this.channels = this.module.json(this.module.link_open());
    this.writer = this.port.writable.getWriter();
    this.isOpen = true;
    this.reading = this.read();
  }

  // Sends a request at once, whatever is waited for, and never again. Fulfils with the answer's content.
  ask(body) {
    if (!this.isOpen) return Promise.reject(new Error("not connected"));
    this.module.putJson(body);
    let asked;
    try {
      asked = contentOf(this.module.json(this.module.link_ask()));
    } catch (error) {
      return Promise.reject(error);
    }
    const frame = this.module.bytes(this.module.link_frame()).slice();
    this.writer.write(frame).catch((error) => this.end(error.message));
    return new Promise((done, failed) => {
      const longest = body.store ? STORED_MS : ANSWER_MS;
      const late = () => this.settle(asked.id, { error: `no answer to ${asked.request} within ${longest / 1000} s; it may have been done or not: look at the state` });
      this.waiting.set(asked.id, { done, failed, timer: setTimeout(late, longest) });
    });
  }

  settle(id, reply) {
    const { done, failed, timer } = this.waiting.get(id) ?? {};
    if (!done) return;
    this.waiting.delete(id);
    clearTimeout(timer);
    if ("error" in reply) failed(new Error(reply.error));
    else done(reply.ok);
  }

  async read() {
    let reason = "the port was closed";
    // What the line damaged ends a stream, and the port has another; a port that is gone has none.
    while (this.isOpen && this.port.readable) {
      this.reader = this.port.readable.getReader();
      try {
        for (;;) {
          const { value, done } = await this.reader.read();
          if (done) return this.end(reason);
          this.take(value);
        }
      } catch (error) {
        reason = error.message;
      } finally {
        this.reader.releaseLock();
      }
    }
    return this.end(reason);
  }

  take(bytes) {
    this.module.put(bytes);
    const messages = this.module.json(this.module.link_take());
    const samples = this.module.numbers(this.module.link_samples());
    if (samples.length) this.heard.samples(samples);
    for (const { answer, event, log, foreign } of messages) {
      if (answer) {
        this.answeredAt = performance.now();
        if (answer.restarted) this.heard.restarted();
        this.settle(answer.id, answer);
      }
      if (event) this.heard.event(event);
      if (log) this.heard.log(log);
      if (foreign) this.end(foreign);
    }
  }

  // The connection is over, and says so once.
  end(reason) {
    if (!this.isOpen) return;
    this.isOpen = false;
    for (const id of [...this.waiting.keys()]) this.settle(id, { error: "the connection was lost" });
    this.heard.lost(reason);
    this.release(() => this.writer.abort());
  }

  // Closes the port of a user who leaves, behind what was sent.
  async close() {
    if (!this.isOpen) return;
    this.isOpen = false;
    for (const id of [...this.waiting.keys()]) this.settle(id, { error: "disconnected" });
    await this.release(() => this.writer.close());
  }

  // Gives the port back, as far as it is still there.
  async release(endWriting) {
    const steps = [endWriting, () => this.writer.releaseLock(), () => this.reader.cancel(), () => this.reading, () => this.port.close()];
    for (const step of steps) {
      try {
        await step();
      } catch {
        // It is gone.
      }
    }
  }
}
