// A curve's outline and its range of values, from Samples.

// Draws readings first..last of `values` onto `path` (moveTo, lineTo). Of the readings of one pixel column the extremes
// are kept, so that no peak is lost and no more is drawn than can be seen. The curve breaks at readings that were not valid
// (NaN) and where `gap` seconds or more lie between two.
export function traceCurve(path, time, values, first, last, axes, gap) {
  const { left, perSecond, x0, low, perUnit, y0 } = axes;
  let pixel = NaN;
  let count = 0; // readings of this pixel column; where they began, their extremes, the newest
  let begun = 0;
  let least = 0;
  let most = 0;
  let newest = 0;
  let newestX = 0;
  let penDown = false;
  let moved = false; // since the last moveTo something was drawn
  let before = NaN;

  const flush = () => {
    if (Number.isNaN(pixel) || count === 1) return;
    if (least < Math.min(begun, newest)) path.lineTo(newestX, least);
    if (most > Math.max(begun, newest)) path.lineTo(newestX, most);
    path.lineTo(newestX, newest);
    moved = true;
  };
  const lift = () => {
    flush();
    if (penDown && !moved) path.lineTo(newestX + 1, newest); // a reading that stands alone is a dot
    penDown = false;
    pixel = NaN;
  };

  for (let i = first; i <= last; i += 1) {
    const value = values[i];
    if (Number.isNaN(value) || time[i] - before >= gap) lift();
    before = time[i];
    if (Number.isNaN(value)) continue;
    const x = x0 + (time[i] - left) * perSecond;
    const y = y0 - (value - low) * perUnit;
    if (Math.floor(x) === pixel) {
      if (y < least) least = y;
      if (y > most) most = y;
    } else {
      flush();
      if (penDown) {
        path.lineTo(x, y);
        moved = true;
      } else {
        path.moveTo(x, y);
        penDown = true;
        moved = false;
      }
      pixel = Math.floor(x);
      count = 0;
      begun = y;
      least = y;
      most = y;
    }
    count += 1;
    newest = y;
    newestX = x;
  }
  lift();
}

// Draws the area between `low` and `high` of intervals first..last onto `path`, which is returned. It is interrupted as the
// curve is.
export function traceBand(path, time, low, high, first, last, axes, gap) {
  const { left, perSecond, x0, low: least, perUnit, y0 } = axes;
  const x = (i) => x0 + (time[i] - left) * perSecond;
  const y = (value) => y0 - (value - least) * perUnit;
  const isUnknown = (i) => Number.isNaN(low[i]);
  for (let i = first; i <= last; i += 1) {
    if (isUnknown(i)) continue;
    let end = i;
    while (end < last && !isUnknown(end + 1) && time[end + 1] - time[end] < gap) end += 1;
    path.moveTo(x(i), y(high[i]));
    for (let at = i + 1; at <= end; at += 1) path.lineTo(x(at), y(high[at]));
    for (let at = end; at >= i; at -= 1) path.lineTo(x(at), y(low[at]));
    path.closePath();
    i = end;
  }
  return path;
}

// Least and most of values first..last into `range`, which is returned; NaN when there is none.
export function extent(values, first, last, range) {
  range.low = NaN;
  range.high = NaN;
  for (let i = first; i <= last; i += 1) {
    const value = values[i];
    if (value < range.low || (Number.isNaN(range.low) && !Number.isNaN(value))) range.low = value;
    if (value > range.high || (Number.isNaN(range.high) && !Number.isNaN(value))) range.high = value;
  }
  return range;
}

const PADDING = 0.08;
const SHRINK_BELOW = 0.55; // of the axis in use: below it the axis follows, above it stands still

// Fits `axis` {low, high} to the curve's `range`: at once where the curve leaves it, otherwise only when it is much too
// large, so that the axis does not swim. `least`: the smallest height of an axis.
export function fitAxis(axis, range, least) {
  if (Number.isNaN(range.low)) return axis;
  const height = Math.max(range.high - range.low, least);
  const inside = range.low >= axis.low && range.high <= axis.high;
  if (inside && height > SHRINK_BELOW * (axis.high - axis.low)) return axis;
  const middle = (range.low + range.high) / 2;
  axis.low = middle - height * (0.5 + PADDING);
  axis.high = middle + height * (0.5 + PADDING);
  return axis;
}
