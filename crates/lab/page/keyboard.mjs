// Fields of text, and undo by the keyboard: what is being typed is the browser's, what is set the lab's.
import { differing } from './state.mjs';

const TEXT = 'input[type=text],input[type=search],input[type=number]';

/** Shows what is set of a key in its field, unless a hand is typing there; `always` also then. */
export function field(input, key, text, always = false) {
  const isTyped = document.activeElement === input && input.value !== input.dataset.shown;
  input.dataset.set = key;
  if (isTyped && !always) return;
  input.dataset.shown = text;
  // A field of the browser writes numbers as it likes.
  if (input.value !== text) input.value = text;
}

/** Whether a step of the lab's is the one that this field made. */
function isOwn(input, from, to) {
  const key = input.dataset.set;
  if (!key || !to || input.value !== input.dataset.shown) return false;
  const along = { '~trial': ['~trial', '~angle'] }[key] ?? [key, `b:${key}`];
  return differing(from, to).every(word => along.includes(word));
}

/** Ctrl+Z and Ctrl+Shift+Z. In a field of text they are the browser's, except for what this field has set last. */
export function keyboard(store) {
  addEventListener('keydown', event => {
    if (!(event.ctrlKey || event.metaKey) || event.altKey || event.key.toLowerCase() !== 'z') return;
    const { target } = event;
    const next = (event.shiftKey ? store.future : store.past).at(-1);
    if (target.matches(TEXT) && !isOwn(target, store.state, next)) return;
    event.preventDefault();
    if (event.shiftKey) store.redo();
    else store.undo();
  });
}
