//! Scenes drawn from the schema of scene files: every key there is may be among them, with values that are likely, at a limit, or nonsense.

use serde_json::{Map, Value, json};
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};

/// What `work` finds for each of `numbers`, on a thread per core. Not rayon's: while one of its threads waits for a picture it begins another piece
/// of work on the same stack.
#[allow(dead_code, reason = "for the tests")]
pub(crate) fn on_all_cores<T: Send>(numbers: Range<u64>, work: impl Fn(u64) -> Option<T> + Sync) -> Vec<T> {
    let next = AtomicU64::new(numbers.start);
    let one = || -> Vec<T> {
        std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)).filter(|n| *n < numbers.end)).filter_map(&work).collect()
    };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        let threads: Vec<_> = (0..cores).map(|_| scope.spawn(one)).collect();
        threads.into_iter().flat_map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))).collect()
    })
}

/// Numbers that decide what is drawn: those of given bytes, and when these are used up such as look random.
pub(crate) struct Draw<'b> {
    bytes: &'b [u8],
    state: u64,
}

impl<'b> Draw<'b> {
    /// Everything follows from `seed`, the same on every machine.
    pub(crate) fn of_seed(seed: u64) -> Self {
        Self { bytes: &[], state: seed }
    }

    /// Everything follows from `bytes`.
    #[allow(dead_code, reason = "for the fuzz targets")]
    pub(crate) fn of_bytes(bytes: &'b [u8]) -> Self {
        Self { bytes, state: bytes.len() as u64 }
    }

    /// SplitMix64 (Steele et al. 2014) behind the bytes.
    fn next(&mut self) -> u64 {
        if let Some((first, rest)) = self.bytes.split_at_checked(2) {
            self.bytes = rest;
            // Spread over all bits: shares of a range look at the upper ones.
            return u64::from(u16::from_le_bytes([first[0], first[1]])).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        }
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.state ^ (self.state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// A number from `low` up to `high`.
    pub(crate) fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Below `count`.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        ((u128::from(self.next()) * count as u128) >> 64) as usize
    }

    pub(crate) fn chance(&mut self, p: f64) -> bool {
        self.within(0.0, 1.0) < p
    }

    pub(crate) fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }

    /// A number as scenes have them, or one that none should have.
    fn number(&mut self) -> f64 {
        let (small, usual, power) = (self.within(0.0, 1.0), self.within(-40.0, 40.0), self.within(-12.0, 12.0));
        match self.below(12) {
            0..=4 => small,
            5 | 6 => usual,
            7 => libm_exp10(power),
            8 => self.one(&[0.0, -0.0, 1.0, -1.0, 0.5, 2.0]),
            9 => self.one(&[1e-20, 1e20, -1e20, 1e-300, 1e300, 5e-324, 1.797e308]),
            10 => (small * 100.0).round() / 100.0,
            _ => usual.round(),
        }
    }
}

/// 10 to the power of `x`, near enough.
fn libm_exp10(x: f64) -> f64 {
    format!("1e{}", x.round()).parse().unwrap_or(1.0)
}

/// Values for keys whose size is work, or that do not go together with others most of the time.
fn of_key(path: &str, draw: &mut Draw<'_>) -> Option<Value> {
    Some(match path {
        "volume.phantom" => json!(draw.one(&["marschner-lobb", "hydrogen", "shepp-logan", "distance-field", "cloud"])),
        "volume.size" => json!(draw.one(&[2, 3, 5, 8, 12, 17, 20])),
        "volume.spacing" => json!([0; 3].map(|_| draw.within(0.3, 3.0))),
        "image.width" | "image.height" => json!(draw.one(&[1, 7, 16, 24, 33, 40])),
        "slices.count" => json!(draw.one(&[1, 2, 3, 8, 17, 40, 64])),
        "slices.spacing" => json!(draw.within(0.2, 3.0)),
        "slices.tolerance" => json!(draw.one(&[0.05, 0.02, 0.01])),
        "slices.jitter" => json!(draw.below(4)),
        "render.games" => json!(draw.one(&[1, 2, 9])),
        "camera.fov_y" => json!(draw.within(5.0, 120.0)),
        "camera.zoom" => json!(draw.one(&[0.3, 0.5, 1.0, 1.7, 4.0, 30.0])),
        _ => return None,
    })
}

/// A value that `schema` allows, of the key called `name`.
fn of_schema(schema: &Value, name: &str, draw: &mut Draw<'_>) -> Value {
    if let Some(words) = schema["enum"].as_array() {
        return words[draw.below(words.len())].clone();
    }
    for ways in ["oneOf", "anyOf"] {
        if let Some(ways) = schema[ways].as_array() {
            return of_schema(&ways[draw.below(ways.len())], name, draw);
        }
    }
    if let Some(value) = schema.get("const") {
        return value.clone();
    }
    let kinds: Vec<&str> = match &schema["type"] {
        Value::String(kind) => vec![kind],
        Value::Array(kinds) => kinds.iter().filter_map(Value::as_str).filter(|k| *k != "null").collect(),
        _ => return Value::Null,
    };
    match draw.one(&kinds) {
        "number" => json!(draw.number()),
        "integer" => json!(draw.below(9)),
        "boolean" => json!(draw.chance(0.5)),
        "string" => json!(draw.one(&["", "cloud", "a name", "x\u{0}y", "\u{1f9e0}"])),
        "array" => {
            let least = schema["minItems"].as_u64().unwrap_or(1) as usize;
            let most = schema["maxItems"].as_u64().unwrap_or(least as u64 + 3) as usize;
            let count = least + draw.below(most - least + 1);
            let mut items: Vec<Value> = (0..count).map(|_| of_schema(&schema["items"], name, draw)).collect();
            // Colours, ranges and lists of points mean something in order.
            if name.contains("color") || name == "background" {
                items.iter_mut().filter(|i| i.is_number()).for_each(|i| *i = json!(draw.within(0.0, 1.0)));
            }
            if items.iter().all(|i| i.is_array()) {
                for (n, item) in items.iter_mut().filter_map(Value::as_array_mut).enumerate() {
                    item.iter_mut().filter(|x| x.is_number()).for_each(|x| *x = json!(draw.within(0.0, 1.0)));
                    if let Some(first) = item.first_mut().filter(|x| x.is_number()) {
                        *first = json!((n as f64 + draw.within(0.0, 1.0)) / count as f64);
                    }
                }
            }
            if matches!(name, "range" | "window" | "gradient_range") {
                items.sort_by(|a, b| a.as_f64().unwrap_or(0.0).total_cmp(&b.as_f64().unwrap_or(0.0)));
            }
            Value::Array(items)
        }
        "object" => Value::Object(table(schema, name, 0.7, draw)),
        _ => Value::Null,
    }
}

/// A table of what `schema` requires, and of each other key with the chance `p`.
fn table(schema: &Value, path: &str, p: f64, draw: &mut Draw<'_>) -> Map<String, Value> {
    let required: Vec<&str> = schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
    let mut all = Map::new();
    for (name, inner) in schema["properties"].as_object().into_iter().flatten() {
        if required.contains(&name.as_str()) || draw.chance(p) {
            let value = of_key(&format!("{path}.{name}"), draw).unwrap_or_else(|| of_schema(inner, name, draw));
            all.insert(name.clone(), value);
        }
    }
    all
}

/// A scene file in JSON, of a built-in volume and a small picture, and some keys from all of `schema`.
pub(crate) fn document(schema: &Value, draw: &mut Draw<'_>) -> Value {
    let key = |path: &str, draw: &mut Draw<'_>| of_key(path, draw).unwrap_or(Value::Null);
    let mut all = json!({
        "volume": { "phantom": key("volume.phantom", draw), "size": key("volume.size", draw) },
        "image": { "width": key("image.width", draw), "height": key("image.height", draw) },
        "slices": { "count": key("slices.count", draw) },
        "camera": { "azimuth": draw.within(-180.0, 180.0), "elevation": draw.within(-90.0, 90.0) },
    });
    if draw.chance(0.5) {
        all["camera"]["projection"] = json!("perspective");
    }
    if draw.chance(0.6) {
        all["transfer"] = json!({
            "color": of_schema(&schema["properties"]["transfer"]["properties"]["color"], "color", draw),
            "opacity": of_schema(&schema["properties"]["transfer"]["properties"]["opacity"], "opacity", draw),
        });
    }
    // Files are other tests' matter.
    const FILES: [&str; 4] = ["path", "file", "layers", "type"];
    let Some(sections) = schema["properties"].as_object() else { return all };
    let names: Vec<&String> = sections.keys().filter(|n| *n != "labels" && *n != "annotate").collect();
    for _ in 0..draw.below(5) {
        let section = draw.one(&names);
        let inner = &sections[section.as_str()];
        if inner["type"] == "array" {
            let count = 1 + draw.below(2);
            let tables = (0..count).map(|_| Value::Object(table(&inner["items"], section, 0.6, draw))).collect();
            all[section.as_str()] = Value::Array(tables);
            continue;
        }
        let keys: Vec<&String> = inner["properties"].as_object().into_iter().flatten().map(|(k, _)| k).collect();
        if keys.is_empty() {
            continue;
        }
        for _ in 0..=draw.below(2) {
            let name = draw.one(&keys);
            if FILES.contains(&name.as_str()) {
                continue;
            }
            let value =
                of_key(&format!("{section}.{name}"), draw).unwrap_or_else(|| of_schema(&inner["properties"][name.as_str()], name, draw));
            // One way to say how many slices there are.
            if section == "slices" && matches!(name.as_str(), "spacing" | "tolerance") {
                all["slices"].as_object_mut().map(|s| s.remove("count"));
            }
            all[section.as_str()][name.as_str()] = value;
        }
    }
    all
}
