// The engine in a worker of this browser: in the place of the one that asks a server.
import { frames } from './decode.mjs';

// The page loads this module before all others: while they come, the worker starts, and the engine is compiled as its bytes arrive.
const worker = new Worker(new URL('worker.mjs', import.meta.url), { type: 'module' });
const bytes = () => fetch(new URL('engine.wasm', import.meta.url));
// Where the host names the wrong type of content, it is compiled in one piece.
WebAssembly.compileStreaming(bytes()).catch(async () => WebAssembly.compile(await (await bytes()).arrayBuffer()))
  .then(compiled => worker.postMessage({ compiled }), error => worker.postMessage({ failed: String(error) }));

export async function open() {
  const open = new Map();
  let next = 0;
  worker.addEventListener('message', ({ data }) => {
    const question = open.get(data.id);
    if (!question) return;
    if (data.frames) {
      question.frame(new Uint8Array(data.frames));
      return;
    }
    open.delete(data.id);
    if (data.error) question.failed(Object.assign(new Error(data.error.message ?? String(data.error)), { key: data.error.key }));
    else question.done(data.answer);
  });
  const ask = (name, body, frame, signal) => new Promise((done, failed) => {
    const id = next;
    next += 1;
    open.set(id, { done, failed, frame });
    signal?.addEventListener('abort', () => {
      open.delete(id);
      worker.postMessage({ stop: id });
      failed(new DOMException('stopped', 'AbortError'));
    });
    worker.postMessage({ id, name, body });
  });
  const text = new TextDecoder();
  const json = async (name, body) => JSON.parse(text.decode(await ask(name, body)));
  return {
    files: false,
    start: () => json('start'),
    setting: body => json('setting', body),
    pair: body => json('pair', body),
    convert: body => json('convert', body),
    detection: body => ask('detection', body),
    cloud: (body, frame, signal) => ask('cloud', body, frames(frame), signal),
  };
}
