// The engine behind the address of this page.
import { frames } from './decode.mjs';

class Refused extends Error {
  constructor(message, key, lost = false) {
    super(message);
    this.key = key;
    this.lost = lost;
  }
}

async function post(name, body, signal) {
  let response;
  try {
    response = await fetch(`api/${name}`, { method: 'POST', body: JSON.stringify(body ?? {}), signal });
  } catch (error) {
    if (error.name === 'AbortError') throw error;
    throw new Refused('The lab does not answer.', null, true);
  }
  if (response.ok) return response;
  const text = await response.text();
  let refusal = { message: text.trim() };
  try { refusal = JSON.parse(text); } catch { /* Not of the bench: its text says it all. */ }
  throw new Refused(refusal.message, refusal.key);
}

const json = async (name, body) => (await post(name, body)).json();

export async function open() {
  return {
    files: true,
    start: () => json('start'),
    setting: body => json('setting', body),
    pair: body => json('pair', body),
    convert: body => json('convert', body),
    advice: body => json('advice', body),
    folder: () => json('folder'),
    progress: path => json('progress', { path }),
    report: path => `report/${path.split('/').map(encodeURIComponent).join('/')}`,
    detection: async body => (await post('detection', body)).arrayBuffer(),
    async cloud(body, frame, signal) {
      const response = await post('cloud', body, signal);
      const reader = response.body.getReader();
      const take = frames(frame);
      for (;;) {
        let part;
        try {
          part = await reader.read();
        } catch (error) {
          if (error.name === 'AbortError') throw error;
          throw new Refused('The lab does not answer.', null, true);
        }
        if (part.done) return;
        take(part.value);
      }
    },
  };
}
