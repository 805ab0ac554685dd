// The engine in a worker: takes questions, answers them, and fills clouds between them.
const text = new TextEncoder();
const read = new TextDecoder();
let module = null;
const questions = [];
const clouds = new Map();
let current = null;

/** Calls the module with these texts in its memory; an answer, an error, or null at the end. */
function call(name, ...parts) {
  const bytes = parts.map(part => text.encode(part));
  const length = bytes.reduce((sum, part) => sum + part.length, 0);
  const { memory, reserve } = module;
  let at = reserve(length);
  for (const part of bytes) {
    new Uint8Array(memory.buffer, at, part.length).set(part);
    at += part.length;
  }
  const out = name === 'answer' ? module.answer(bytes[1].length) : module[name]();
  const [code, size] = new Uint32Array(memory.buffer.slice(out, out + 8));
  const answer = memory.buffer.slice(out + 8, out + 8 + size);
  if (code === 1) throw JSON.parse(read.decode(answer));
  return code === 2 ? null : answer;
}

/** Makes the module. What libraries would import of a browser, such as its random numbers, nothing that the lab does calls. */
async function make(compiled) {
  const imports = {};
  for (const { module: from, name, kind } of WebAssembly.Module.imports(compiled)) {
    if (kind === 'function') (imports[from] ??= {})[name] = () => { throw new Error(`the engine has no ${name}`); };
  }
  module = (await WebAssembly.instantiate(compiled, imports)).exports;
}

let failure = null;
let known = null;
const ready = new Promise(done => { known = done; });

function one({ id, name, body }) {
  try {
    if (failure) throw new Error(failure);
    postMessage({ id, answer: call('answer', name, JSON.stringify(body ?? null)) });
  } catch (error) {
    postMessage({ id, error });
  }
}

/** One step of the cloud that is under way, or the first of the next one. */
function step() {
  if (current && clouds.get(current.slot) !== current) current = null;
  try {
    if (!current) {
      current = clouds.values().next().value;
      call('begin', JSON.stringify(current.body));
    }
    const frames = call('step');
    if (frames) {
      postMessage({ id: current.id, frames }, [frames]);
      return;
    }
    postMessage({ id: current.id, answer: null });
  } catch (error) {
    postMessage({ id: current.id, error });
  }
  clouds.delete(current.slot);
  current = null;
}

const pulse = new MessageChannel();
let waiting = false;
function soon() {
  if (waiting) return;
  waiting = true;
  pulse.port2.postMessage(null);
}
pulse.port1.onmessage = async () => {
  await ready;
  waiting = false;
  // Questions of the hand come before clouds.
  if (questions.length) one(questions.shift());
  else if (clouds.size) step();
  if (questions.length || clouds.size) soon();
};

addEventListener('message', ({ data }) => {
  if (data.compiled || data.failed) {
    failure = data.failed ? `The engine could not be loaded (${data.failed}): load the page again.` : null;
    known(data.compiled && make(data.compiled).catch(error => { failure = String(error); }));
    return;
  }
  if (data.stop !== undefined) {
    for (const [slot, cloud] of clouds) if (cloud.id === data.stop) clouds.delete(slot);
  } else if (data.name === 'cloud') {
    clouds.delete(data.body.slot);
    clouds.set(data.body.slot, { ...data, slot: data.body.slot });
  } else questions.push(data);
  soon();
});
