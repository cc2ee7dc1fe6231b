"use strict";
// The WebAssembly module: the bench, and the page's end of the link; requests as JSON, samples and words as arrays.

async function openModule() {
  const packed = Uint8Array.from(atob(WASM), (character) => character.charCodeAt(0));
  const unpacked = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  const { instance } = await WebAssembly.instantiate(await new Response(unpacked).arrayBuffer(), {});
  const { memory, room, length, ...functions } = instance.exports;
  const encoder = new TextEncoder();
  const decoder = new TextDecoder();
  return {
    ...functions,
    // Hands bytes over to the next function.
    put(bytes) {
      const place = room(bytes.length);
      new Uint8Array(memory.buffer, place, bytes.length).set(bytes);
    },
    putJson(value) {
      this.put(encoder.encode(JSON.stringify(value)));
    },
    // What a function left, valid until the next call.
    bytes: (place) => new Uint8Array(memory.buffer, place, length()),
    numbers: (place) => new Float64Array(memory.buffer, place, length() / 8),
    json: (place) => JSON.parse(decoder.decode(new Uint8Array(memory.buffer, place, length()))),
  };
}

// The content of a reply, or its reason as an error.
function contentOf(reply) {
  if ("error" in reply) throw new Error(reply.error);
  return reply.ok;
}

async function openBench() {
  const module = await openModule();
  return {
    // Returns the reply, or throws the reason. A request is a name, or a name with its fields.
    request(body) {
      module.putJson(body);
      return contentOf(module.json(module.request()));
    },
    // Runs control periods. The samples are valid until the next call.
    advance: (ticks) => module.numbers(module.advance(ticks)),
    // Runs control periods and returns the converters' words as bytes, valid until the next call.
    words: (ticks) => module.bytes(module.words(ticks)),
  };
}
