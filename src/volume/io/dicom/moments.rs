//! Which of several images at each position is meant: moments, echoes, strengths of diffusion, or a scan that was repeated.

use super::geometry::Builder;
use super::image::{Facts, KEYS, key};
use super::series::Frame;
use std::cmp::Ordering;
use std::collections::BTreeSet;

/// What images at one position may be told apart by, the surest first.
const SIGNS: [&[usize]; 8] = [
    &[key::TEMPORAL],
    &[key::TRIGGER],
    &[key::ECHO],
    &[key::B_VALUE],
    &[key::B_VALUE, key::GRADIENT, key::GRADIENT + 1, key::GRADIENT + 2],
    ALL_BUT_TIME,
    &[key::ACQUISITION],
    &[key::TIME],
];

/// All keys but number and time of the acquisition.
const ALL_BUT_TIME: &[usize] = &[0, 1, 2, 3, 4, 5, 6];

/// Keys by their names: of one, of several whose values may be shown, and the unit.
const NAMES: [(&str, &str, &str, &[usize]); 7] = [
    ("temporal position", "temporal positions", "", &[key::TEMPORAL]),
    ("trigger time", "trigger times", " ms", &[key::TRIGGER]),
    ("echo time", "echo times", " ms", &[key::ECHO]),
    ("b-value", "b-values", " s/mm2", &[key::B_VALUE]),
    ("diffusion direction", "", "", &[key::GRADIENT, key::GRADIENT + 1, key::GRADIENT + 2]),
    ("acquisition number", "acquisition numbers", "", &[key::ACQUISITION]),
    ("acquisition time", "", "", &[key::TIME]),
];

/// Most values that are shown one by one.
const SHOWN: usize = 8;

/// Something to order images at one position by.
type Sign = ([Option<f64>; KEYS], Option<String>, usize);

/// Images of several moments.
pub(super) struct Moments {
    /// What they differ in.
    pub(super) name: String,
    /// The values that they differ in, as far as these are the same at every position.
    pub(super) values: String,
    /// For every position, one image of each moment.
    pub(super) sorted: Vec<Vec<Frame>>,
}

fn sign_of(facts: &Facts, keys: &[usize]) -> [Option<f64>; KEYS] {
    std::array::from_fn(|i| if keys.contains(&i) { facts.keys[i] } else { None })
}

fn order(a: &Sign, b: &Sign) -> Ordering {
    let keys = a.0.iter().zip(&b.0).map(|(a, b)| a.unwrap_or(f64::NEG_INFINITY).total_cmp(&b.unwrap_or(f64::NEG_INFINITY)));
    keys.fold(Ordering::Equal, Ordering::then).then_with(|| a.1.cmp(&b.1)).then(a.2.cmp(&b.2))
}

/// "a, b and c".
pub(super) fn listed(words: &[String]) -> String {
    match words {
        [] => String::new(),
        [one] => one.clone(),
        [rest @ .., last] => format!("{} and {last}", rest.join(", ")),
    }
}

impl Builder<'_> {
    /// Images at the same position: one of each for every moment, ordered, and what they differ in. `None` where nothing tells them apart.
    pub(super) fn moments(&self, clusters: &[Vec<Frame>]) -> Option<Moments> {
        let count = clusters[0].len();
        if clusters.iter().any(|c| c.len() != count) {
            return SIGNS.into_iter().find_map(|keys| Some(self.named(self.complete(clusters, keys)?, keys, None)));
        }
        let one_file = clusters.iter().flatten().all(|f| f.image == clusters[0][0].image);
        let tried = SIGNS.map(|keys| (keys, false, false));
        let last = [(ALL_BUT_TIME, true, false), (&[][..], false, true)];
        for (keys, by_kind, by_order) in tried.into_iter().chain(last) {
            if by_order && !one_file {
                continue;
            }
            let sign = |f: &Frame| -> Sign {
                let kind = if by_kind { self.facts(f).kind.as_deref().map(str::to_owned) } else { None };
                (sign_of(self.facts(f), keys), kind, if by_order { f.frame } else { 0 })
            };
            let sorted = clusters.iter().map(|cluster| {
                let mut signed: Vec<(Sign, Frame)> = cluster.iter().map(|f| (sign(f), *f)).collect();
                signed.sort_by(|a, b| order(&a.0, &b.0));
                let distinct = signed.windows(2).all(|w| order(&w[0].0, &w[1].0).is_lt());
                distinct.then(|| signed.into_iter().map(|s| s.1).collect::<Vec<_>>())
            });
            if let Some(sorted) = sorted.collect::<Option<Vec<_>>>() {
                let also = if by_kind { Some("kind of image") } else { by_order.then_some("order in the file") };
                return Some(self.named(sorted, keys, also));
            }
        }
        None
    }

    /// Those moments that have one image at every position, where others do not: a scan that was broken off.
    fn complete(&self, clusters: &[Vec<Frame>], keys: &[usize]) -> Option<Vec<Vec<Frame>>> {
        let sign = |f: &Frame| -> Sign { (sign_of(self.facts(f), keys), None, 0) };
        let mut moments: Vec<Sign> = clusters[0].iter().map(sign).collect();
        moments.sort_by(order);
        let of = |cluster: &[Frame], moment: &Sign| -> Vec<Frame> {
            cluster.iter().filter(|f| order(&sign(f), moment).is_eq()).copied().collect()
        };
        let distinct = moments.windows(2).all(|w| order(&w[0], &w[1]).is_lt());
        moments.retain(|m| clusters.iter().all(|c| of(c, m).len() == 1));
        (distinct && !moments.is_empty()).then(|| clusters.iter().map(|c| moments.iter().flat_map(|m| of(c, m)).collect()).collect())
    }

    /// A scan that was repeated as a whole: every position equally often, each time with larger instance numbers than before.
    pub(super) fn repeats(&self, clusters: &[Vec<Frame>]) -> Option<Moments> {
        let count = clusters[0].len();
        let instance = |f: &Frame| self.study.images[f.image].instance;
        let all: Option<BTreeSet<i64>> = clusters.iter().flatten().map(instance).collect();
        if clusters.iter().any(|c| c.len() != count) || all?.len() != count * clusters.len() {
            return None;
        }
        let mut sorted = clusters.to_vec();
        sorted.iter_mut().for_each(|c| c.sort_by_key(instance));
        let largest = |moment: usize| sorted.iter().map(|c| instance(&c[moment])).max();
        let smallest = |moment: usize| sorted.iter().map(|c| instance(&c[moment])).min();
        let in_blocks = (1..count).all(|moment| largest(moment - 1) < smallest(moment));
        in_blocks.then(|| Moments { name: "instance number".to_owned(), values: String::new(), sorted })
    }

    /// What of `keys` the images really differ in, and `also`.
    fn named(&self, sorted: Vec<Vec<Frame>>, keys: &[usize], also: Option<&str>) -> Moments {
        let (mut names, mut values) = (Vec::new(), Vec::new());
        let key = |f: &Frame, at: usize| self.facts(f).keys[at];
        for (name, several, unit, at) in NAMES {
            let differs = |c: &Vec<Frame>| at.iter().any(|&i| c.iter().any(|f| key(f, i) != key(&c[0], i)));
            if !at.iter().all(|i| keys.contains(i)) || !sorted.iter().any(differs) {
                continue;
            }
            names.push(name.to_owned());
            let same = |c: &Vec<Frame>| c.iter().zip(&sorted[0]).all(|(a, b)| key(a, at[0]) == key(b, at[0]));
            if several.is_empty() || !sorted.iter().all(same) {
                continue;
            }
            let mut found: Vec<f64> = sorted[0].iter().filter_map(|f| key(f, at[0])).collect();
            found.sort_by(f64::total_cmp);
            found.dedup();
            values.push(match found[..] {
                [first, .., last] if found.len() > SHOWN => format!("{} {several} from {first} to {last}{unit}", found.len()),
                _ => format!("{several} {}{unit}", listed(&found.iter().map(f64::to_string).collect::<Vec<_>>())),
            });
        }
        names.extend(also.map(str::to_owned));
        // What is left is a moment that alone was taken at every position.
        if names.is_empty() {
            names = NAMES.iter().filter(|n| n.3.iter().all(|i| keys.contains(i))).map(|n| n.0.to_owned()).collect();
        }
        Moments { name: listed(&names), values: values.join("; "), sorted }
    }
}
