"use strict";
// The WebAssembly module: one bench an instance, requests as JSON, samples and words as arrays.

async function openBench() {
  const bytes = Uint8Array.from(atob(WASM), (character) => character.charCodeAt(0));
  const { instance } = await WebAssembly.instantiate(bytes, {});
  const { memory, room, request, advance, words, length } = instance.exports;
  const encoder = new TextEncoder();
  const decoder = new TextDecoder();
  return {
    // Returns the reply, or throws the reason. A request is a name, or a name with its fields.
    request(body) {
      const text = encoder.encode(JSON.stringify(body));
      const place = room(text.length);
      new Uint8Array(memory.buffer, place, text.length).set(text);
      const reply = request();
      const answer = JSON.parse(decoder.decode(new Uint8Array(memory.buffer, reply, length())));
      if ("error" in answer) throw new Error(answer.error);
      return answer.ok;
    },
    // Runs control periods. The samples are valid until the next call.
    advance(ticks) {
      const place = advance(ticks);
      return new Float64Array(memory.buffer, place, length() / 8);
    },
    // Runs control periods and returns the converters' words as bytes, valid until the next call.
    words(ticks) {
      const place = words(ticks);
      return new Uint8Array(memory.buffer, place, length());
    },
  };
}
