// Shows the picture of the direction at hand. Pictures are fetched when they are near, and kept.

const told = JSON.parse(document.getElementById("told").textContent);
const [view, picture, where, around, upwards] = ["view", "picture", "where", "around", "upwards"].map((id) => document.getElementById(id));
const columns = told.names[0].length, rows = told.names.length;
/// Pixels of a drag that lead to the next picture.
const STEP = [Math.max(4, 360 / columns), 40];
/// Pictures that are fetched beforehand, to both sides.
const AHEAD = 3;

const state = { column: 0, row: told.row };
const kept = new Map();

function fetched(column, row) {
  const name = told.names[row][column];
  if (!kept.has(name)) {
    const image = new Image();
    image.src = name;
    kept.set(name, image);
  }
  return kept.get(name);
}

function words() {
  const degrees = Math.round((360 * state.column) / columns), elevation = Math.round(told.elevations[state.row]);
  const height = elevation === 0 ? "level" : `${Math.abs(elevation)} degrees from ${elevation > 0 ? "above" : "below"}`;
  return `${degrees} degrees around, ${height}`;
}

function show() {
  const { column, row } = state;
  const image = fetched(column, row);
  // The picture before it stays until this one can be drawn.
  const draw = () => {
    if (state.column === column && state.row === row) picture.src = image.src;
  };
  image.decode().then(draw, draw);
  picture.alt = `${told.title}, seen from ${words()}`;
  where.textContent = words();
  around.value = column;
  upwards.value = row;
  around.setAttribute("aria-valuetext", words());
  upwards.setAttribute("aria-valuetext", words());
  for (let n = 1; n <= AHEAD; n++) for (const side of [n, -n]) fetched((column + side + columns * AHEAD) % columns, row);
  for (const side of [-1, 1]) if (told.names[row + side]) fetched(column, row + side);
}

function turn(right, up) {
  state.column = (((state.column + right) % columns) + columns) % columns;
  state.row = Math.min(rows - 1, Math.max(0, state.row + up));
  show();
}

let from = null;
view.addEventListener("pointerdown", (event) => {
  if (!event.isPrimary || event.button !== 0) return;
  view.setPointerCapture(event.pointerId);
  from = [event.clientX, event.clientY];
});
view.addEventListener("pointermove", (event) => {
  if (!from || !event.isPrimary) return;
  const steps = [Math.trunc((event.clientX - from[0]) / STEP[0]), Math.trunc((event.clientY - from[1]) / STEP[1])];
  if (!steps[0] && !steps[1]) return;
  from = [from[0] + steps[0] * STEP[0], from[1] + steps[1] * STEP[1]];
  // The volume follows the pointer: the eye goes the other way.
  turn(-steps[0], steps[1]);
});
for (const end of ["pointerup", "pointercancel"]) view.addEventListener(end, () => (from = null));
view.addEventListener("keydown", (event) => {
  const way = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1], Home: [-state.column, told.row - state.row] }[event.key];
  if (!way || event.ctrlKey || event.altKey || event.metaKey) return;
  event.preventDefault();
  turn(...way);
});
around.max = columns - 1;
upwards.max = rows - 1;
upwards.disabled = rows === 1;
around.addEventListener("input", () => turn(around.valueAsNumber - state.column, 0));
upwards.addEventListener("input", () => turn(0, upwards.valueAsNumber - state.row));
document.getElementById("title").textContent = told.title;
show();
