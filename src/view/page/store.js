// The scene in view, as the document that the server is sent, and the documents before it.
//
// A document is never changed: a change makes a new one. So undo is a list of documents.

/// The value at `section.key`, or undefined.
export function at(document, path) {
  return path.split(".").reduce((value, key) => value?.[key], document);
}

/// A copy of `document` with `value` at `section.key`; undefined takes the key away, and its section with the last one.
export function withKey(document, path, value) {
  const [key, ...rest] = path.split(".");
  const copy = { ...document };
  const next = rest.length ? withKey(copy[key] ?? {}, rest.join("."), value) : value;
  const empty = rest.length > 0 && Object.keys(next).length === 0;
  if (next === undefined || empty) delete copy[key];
  else copy[key] = next;
  return copy;
}

/// `document` with several keys set: { "section.key": value }.
export function withKeys(document, keys) {
  return Object.entries(keys).reduce((d, [path, value]) => withKey(d, path, value), document);
}

/// Most steps that can be undone.
const STEPS = 200;

/// A store of `first`, or of what was `made` of it before. `fit` makes a document fit the picture's present size.
export function createStore(first, fit, made = null) {
  // What is in view, what the server has last drawn, and what undo goes by: a drag is one step, however many documents it passes.
  let document = made ?? first, accepted = first, committed = document;
  let past = made ? [first] : [], future = [];
  // Whether a hand holds something: what it does until it lets go is one step, also where it rests meanwhile.
  let held = false;
  const listeners = new Set();
  const tell = () => listeners.forEach((listener) => listener(document));

  const store = {
    get document() {
      return document;
    },
    get canUndo() {
      return past.length > 0 || document !== committed;
    },
    get canRedo() {
      return future.length > 0;
    },
    subscribe(listener) {
      listeners.add(listener);
    },
    /// Shows `next`.
    set(next) {
      if (next === document) return;
      document = next;
      tell();
    },
    /// A hand has taken hold of something.
    hold() {
      held = true;
    },
    /// It has let go.
    release() {
      held = false;
      store.settle();
    },
    /// The changes since the last call are one step, unless a hand is still at it.
    settle() {
      if (held || document === committed) return;
      past = [...past, committed].slice(-STEPS);
      future = [];
      committed = document;
      tell();
    },
    undo() {
      store.release();
      if (!past.length) return;
      future.push(committed);
      document = committed = fit(past.pop());
      tell();
    },
    redo() {
      if (document !== committed || !future.length) return;
      past.push(committed);
      document = committed = fit(future.pop());
      tell();
    },
    /// The picture has another size: no step.
    refit() {
      const same = document === committed;
      document = fit(document);
      committed = same ? document : fit(committed);
      tell();
    },
    /// The server has drawn `drawn`.
    accept(drawn) {
      accepted = drawn;
    },
    /// The server refuses `refused`: what it has drawn last stays.
    refuse(refused) {
      if (document !== refused || accepted === refused) return;
      // The step that led to it is none.
      if (committed === refused) committed = past.pop() ?? accepted;
      document = accepted;
      tell();
    },
  };
  return store;
}
