// What computes. The page knows nothing of it but these calls; another file in this one's place puts another engine behind them:
//
//   open()                          → an engine
//   start()                         → what a page needs to know once: controls, version, folder
//   setting({setting, trial, angle, trials}) → what all keys come to, and texts to copy
//   detection({setting, trial, angle})       → bytes, see decode.mjs
//   cloud({setting, trials, slot}, frame, signal) → calls frame(kind, bytes) as they come; ends when all are there
//   advice({setting})               → what `check` recommends: keys to set, or none, and a sentence; not every engine has it
//   convert({numbers})              → a data sheet’s numbers in all the ways in which they are given, and texts to copy
//   pair({a, b})                    → how B differs from A, trial by trial
//   folder(), progress(path), report(path)   → of an engine with files; report is an address
//
// Errors have a `message`, and a `key` where they are about one; `lost` is true where nothing answers at all.
export { open } from './server.mjs';
