// What of an address the engine takes.

/** A refusal without its list of all keys, where it names the one that was meant. */
const short = message => message.replace(/^set by the lab: /, '').replace(/`[^`]*`: (?=unknown)/, '')
  .replace(/\?( Known: .*)$/, '?').replace(/\.$/, '');

/** The state without what cannot be, which goes into `broken` with its reason: the rest of a link is worth as much as before. */
export async function sound(state, engine, broken) {
  const { trial, angle, trials } = state;
  const fault = async set => {
    try {
      await engine.setting({ setting: { scenario: state.scenario, point: state.point, set }, trial, angle, trials });
      return null;
    } catch (error) {
      if (error.lost) throw error;
      return error;
    }
  };
  const refuse = (key, value, error) => broken.push({ key, value, why: short(error.message) });
  for (const [name, plain] of [['point', 0], ['scenario', '']]) {
    const error = state[name] === plain ? null : await fault({});
    if (!error) continue;
    refuse(`~${name}`, state[name], error);
    state[name] = plain;
  }
  for (const side of ['a', 'b']) {
    if (!state[side] || !Object.keys(state[side]).length) continue;
    const before = side === 'b' ? 'b:' : '';
    for (let error = await fault(state[side]); error; error = await fault(state[side])) {
      const [wrong, why] = Object.hasOwn(state[side], error.key ?? '') ? [error.key, error] : await first(state[side], fault);
      if (wrong === null) break;
      refuse(before + wrong, state[side][wrong], why);
      delete state[side][wrong];
    }
  }
  return state;
}

/** The first key with which a setting cannot be, and why. */
async function first(set, fault) {
  const rank = key => ({ motor: 0, 'motor.base': 1, 'detector.method': 2 }[key] ?? 3);
  const taken = {};
  for (const key of Object.keys(set).sort((a, b) => rank(a) - rank(b))) {
    taken[key] = set[key];
    const error = await fault(taken);
    if (error) return [key, error];
  }
  return [null, null];
}
