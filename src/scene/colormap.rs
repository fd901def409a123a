//! The colour maps that people expect by name, as few control points as do the job.
//!
//! Sources: viridis, inferno, magma and plasma by Stefan van der Walt, Nathaniel Smith and Eric Firing (CC0); cividis by
//! Jamie Nunez, Christopher Anderton and Ryan Renslow (PLOS ONE 13(7), 2018; CC BY 4.0); turbo by Anton Mikhailov (Apache-2.0);
//! coolwarm by Kenneth Moreland ("Diverging Color Maps for Scientific Visualization", 2009; free to use); gray, bone and hot as
//! distributed with Matplotlib (a PSF-style licence). The points below were chosen from the 256 entries that
//! Matplotlib publishes for each map, the fewest with which linear interpolation stays within 1/255 of every entry.

#![allow(clippy::approx_constant, reason = "colours that happen to lie near pi / 6 and pi / 8")]

/// Entry of 256, then red, green, blue.
type Point = (u8, [f64; 3]);

/// A named map from `[0,1]` to colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[allow(missing_docs, reason = "the names say it all")]
#[non_exhaustive]
pub enum ColorMap {
    Viridis,
    Inferno,
    Magma,
    Plasma,
    Cividis,
    Turbo,
    Gray,
    Bone,
    Hot,
    Coolwarm,
}

impl ColorMap {
    /// All maps.
    pub const ALL: [Self; 10] = [
        Self::Viridis,
        Self::Inferno,
        Self::Magma,
        Self::Plasma,
        Self::Cividis,
        Self::Turbo,
        Self::Gray,
        Self::Bone,
        Self::Hot,
        Self::Coolwarm,
    ];

    /// The name used in scene files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Viridis => "viridis",
            Self::Inferno => "inferno",
            Self::Magma => "magma",
            Self::Plasma => "plasma",
            Self::Cividis => "cividis",
            Self::Turbo => "turbo",
            Self::Gray => "gray",
            Self::Bone => "bone",
            Self::Hot => "hot",
            Self::Coolwarm => "coolwarm",
        }
    }

    /// The map called `name` in a scene file.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|m| m.name() == name)
    }

    fn table(self) -> &'static [Point] {
        match self {
            Self::Viridis => VIRIDIS,
            Self::Inferno => INFERNO,
            Self::Magma => MAGMA,
            Self::Plasma => PLASMA,
            Self::Cividis => CIVIDIS,
            Self::Turbo => TURBO,
            Self::Gray => GRAY,
            Self::Bone => BONE,
            Self::Hot => HOT,
            Self::Coolwarm => COOLWARM,
        }
    }

    /// The map's control points laid over the values `lo` to `hi`: value, then straight red, green, blue in `[0,1]`, ready for
    /// [`super::TransferFunction::new`]. With `lo` above `hi` the map runs backwards.
    pub fn spread(self, lo: f64, hi: f64) -> Vec<(f64, [f64; 3])> {
        let mut points: Vec<_> = self
            .table()
            .iter()
            .map(|&(i, rgb)| {
                let t = f64::from(i) / 255.0;
                // Exact at both ends, whatever they are.
                (lo * (1.0 - t) + hi * t, rgb)
            })
            .collect();
        if lo > hi {
            points.reverse();
        }
        points
    }
}

const VIRIDIS: &[Point] = &[
    (0, [0.2670, 0.0049, 0.3294]),
    (19, [0.2831, 0.1106, 0.4316]),
    (35, [0.2762, 0.1901, 0.4930]),
    (52, [0.2522, 0.2698, 0.5316]),
    (75, [0.2086, 0.3678, 0.5527]),
    (116, [0.1433, 0.5228, 0.5563]),
    (139, [0.1195, 0.6075, 0.5402]),
    (151, [0.1301, 0.6514, 0.5216]),
    (162, [0.1664, 0.6909, 0.4965]),
    (175, [0.2394, 0.7356, 0.4557]),
    (190, [0.3524, 0.7830, 0.3926]),
    (208, [0.5160, 0.8312, 0.2943]),
    (235, [0.7938, 0.8807, 0.1200]),
    (242, [0.8660, 0.8899, 0.0960]),
    (248, [0.9261, 0.8973, 0.1041]),
    (255, [0.9932, 0.9062, 0.1439]),
];
const INFERNO: &[Point] = &[
    (0, [0.0015, 0.0005, 0.0139]),
    (5, [0.0077, 0.0061, 0.0468]),
    (14, [0.0334, 0.0237, 0.1234]),
    (28, [0.1046, 0.0470, 0.2534]),
    (39, [0.1765, 0.0414, 0.3481]),
    (47, [0.2315, 0.0364, 0.3924]),
    (58, [0.3036, 0.0494, 0.4222]),
    (75, [0.4101, 0.0879, 0.4331]),
    (95, [0.5347, 0.1325, 0.4167]),
    (115, [0.6585, 0.1790, 0.3727]),
    (137, [0.7859, 0.2471, 0.2955]),
    (156, [0.8780, 0.3321, 0.2123]),
    (174, [0.9415, 0.4364, 0.1254]),
    (192, [0.9784, 0.5579, 0.0349]),
    (198, [0.9846, 0.6011, 0.0236]),
    (203, [0.9873, 0.6379, 0.0349]),
    (211, [0.9871, 0.6979, 0.0877]),
    (223, [0.9761, 0.7900, 0.1960]),
    (233, [0.9587, 0.8666, 0.3108]),
    (241, [0.9468, 0.9242, 0.4264]),
    (248, [0.9545, 0.9659, 0.5404]),
    (255, [0.9884, 0.9984, 0.6449]),
];
const MAGMA: &[Point] = &[
    (0, [0.0015, 0.0005, 0.0139]),
    (6, [0.0094, 0.0080, 0.0528]),
    (17, [0.0438, 0.0338, 0.1419]),
    (32, [0.1131, 0.0655, 0.2768]),
    (44, [0.1848, 0.0657, 0.3880]),
    (52, [0.2388, 0.0595, 0.4433]),
    (61, [0.2977, 0.0661, 0.4782]),
    (76, [0.3904, 0.1004, 0.5019]),
    (100, [0.5378, 0.1569, 0.5066]),
    (122, [0.6778, 0.2022, 0.4858]),
    (143, [0.8109, 0.2529, 0.4393]),
    (158, [0.8947, 0.3098, 0.3940]),
    (172, [0.9502, 0.3908, 0.3625]),
    (183, [0.9751, 0.4689, 0.3631]),
    (195, [0.9894, 0.5579, 0.3917]),
    (210, [0.9966, 0.6683, 0.4562]),
    (230, [0.9957, 0.8127, 0.5726]),
    (255, [0.9871, 0.9914, 0.7495]),
];
const PLASMA: &[Point] = &[
    (0, [0.0504, 0.0298, 0.5280]),
    (6, [0.1151, 0.0236, 0.5555]),
    (20, [0.2212, 0.0165, 0.6021]),
    (41, [0.3564, 0.0038, 0.6478]),
    (58, [0.4596, 0.0036, 0.6603]),
    (69, [0.5236, 0.0245, 0.6529]),
    (86, [0.6158, 0.0946, 0.6171]),
    (113, [0.7401, 0.2139, 0.5242]),
    (145, [0.8565, 0.3561, 0.4103]),
    (175, [0.9403, 0.4976, 0.3092]),
    (199, [0.9830, 0.6241, 0.2279]),
    (220, [0.9944, 0.7470, 0.1638]),
    (233, [0.9853, 0.8288, 0.1429]),
    (252, [0.9466, 0.9552, 0.1503]),
    (255, [0.9400, 0.9752, 0.1313]),
];
const CIVIDIS: &[Point] = &[
    (0, [0.0000, 0.1351, 0.3048]),
    (20, [0.0000, 0.1888, 0.4396]),
    (23, [0.0036, 0.1959, 0.4416]),
    (28, [0.0690, 0.2094, 0.4389]),
    (36, [0.1307, 0.2315, 0.4328]),
    (52, [0.2134, 0.2753, 0.4245]),
    (84, [0.3387, 0.3622, 0.4281]),
    (133, [0.5069, 0.4997, 0.4724]),
    (164, [0.6247, 0.5920, 0.4606]),
    (194, [0.7447, 0.6872, 0.4204]),
    (219, [0.8492, 0.7719, 0.3597]),
    (237, [0.9277, 0.8365, 0.2906]),
    (252, [0.9948, 0.8930, 0.2034]),
    (255, [0.9957, 0.9093, 0.2178]),
];
const TURBO: &[Point] = &[
    (0, [0.1900, 0.0718, 0.2322]),
    (7, [0.2211, 0.1522, 0.4256]),
    (14, [0.2454, 0.2304, 0.5914]),
    (21, [0.2628, 0.3064, 0.7297]),
    (28, [0.2733, 0.3801, 0.8404]),
    (35, [0.2770, 0.4515, 0.9235]),
    (42, [0.2738, 0.5207, 0.9790]),
    (47, [0.2625, 0.5697, 0.9977]),
    (53, [0.2329, 0.6292, 0.9920]),
    (59, [0.1933, 0.6881, 0.9619]),
    (68, [0.1328, 0.7716, 0.8858]),
    (76, [0.0975, 0.8371, 0.8034]),
    (82, [0.0945, 0.8784, 0.7426]),
    (87, [0.1137, 0.9067, 0.6965]),
    (93, [0.1632, 0.9361, 0.6314]),
    (100, [0.2480, 0.9642, 0.5430]),
    (112, [0.4278, 0.9942, 0.3858]),
    (121, [0.5603, 0.9987, 0.2862]),
    (128, [0.6436, 0.9900, 0.2336]),
    (135, [0.7158, 0.9688, 0.2082]),
    (144, [0.8047, 0.9245, 0.2046]),
    (156, [0.9060, 0.8434, 0.2219]),
    (166, [0.9651, 0.7635, 0.2275]),
    (175, [0.9916, 0.6841, 0.2071]),
    (185, [0.9952, 0.5755, 0.1641]),
    (196, [0.9723, 0.4456, 0.1080]),
    (208, [0.9210, 0.3149, 0.0548]),
    (219, [0.8538, 0.2217, 0.0268]),
    (231, [0.7556, 0.1373, 0.0094]),
    (243, [0.6308, 0.0687, 0.0040]),
    (255, [0.4796, 0.0158, 0.0106]),
];
const GRAY: &[Point] = &[(0, [0.0000, 0.0000, 0.0000]), (255, [1.0000, 1.0000, 1.0000])];
const BONE: &[Point] =
    &[(0, [0.0000, 0.0000, 0.0000]), (93, [0.3191, 0.3191, 0.4440]), (190, [0.6520, 0.7767, 0.7770]), (255, [1.0000, 1.0000, 1.0000])];
const HOT: &[Point] =
    &[(0, [0.0416, 0.0000, 0.0000]), (93, [0.9990, 0.0000, 0.0000]), (190, [1.0000, 0.9975, 0.0000]), (255, [1.0000, 1.0000, 1.0000])];
const COOLWARM: &[Point] = &[
    (0, [0.2298, 0.2987, 0.7537]),
    (20, [0.3237, 0.4332, 0.8647]),
    (38, [0.4148, 0.5469, 0.9391]),
    (55, [0.5054, 0.6440, 0.9832]),
    (72, [0.5978, 0.7273, 0.9998]),
    (89, [0.6882, 0.7932, 0.9880]),
    (106, [0.7727, 0.8390, 0.9493]),
    (125, [0.8554, 0.8638, 0.8766]),
    (131, [0.8796, 0.8582, 0.8458]),
    (148, [0.9358, 0.8122, 0.7472]),
    (165, [0.9648, 0.7446, 0.6432]),
    (182, [0.9673, 0.6575, 0.5382]),
    (199, [0.9441, 0.5532, 0.4355]),
    (217, [0.8921, 0.4254, 0.3333]),
    (236, [0.8106, 0.2688, 0.2354]),
    (247, [0.7527, 0.1576, 0.1843]),
    (255, [0.7057, 0.0156, 0.1502]),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::TransferFunction;

    fn at(map: ColorMap, t: f64) -> [i32; 3] {
        let f = TransferFunction::new(map.spread(0.0, 1.0), vec![(0.0, 1.0)]).expect("valid");
        f.eval(t).rgb.map(|c| (c * 255.0).round() as i32)
    }

    /// First, middle (entry 128) and last entry as published.
    #[test]
    fn ends_and_middle_are_the_published_ones() {
        let published = [
            [[68, 1, 84], [33, 145, 140], [253, 231, 37]],
            [[0, 0, 4], [188, 55, 84], [252, 255, 164]],
            [[0, 0, 4], [183, 55, 121], [252, 253, 191]],
            [[13, 8, 135], [204, 71, 120], [240, 249, 33]],
            [[0, 34, 78], [125, 124, 120], [254, 232, 56]],
            [[48, 18, 59], [164, 252, 60], [122, 4, 3]],
            [[0, 0, 0], [128, 128, 128], [255, 255, 255]],
            [[0, 0, 0], [112, 123, 144], [255, 255, 255]],
            [[11, 0, 0], [255, 92, 0], [255, 255, 255]],
            [[59, 76, 192], [221, 220, 220], [180, 4, 38]],
        ];
        for (map, rows) in ColorMap::ALL.into_iter().zip(published) {
            for (t, want) in [0.0, 128.0 / 255.0, 1.0].into_iter().zip(rows) {
                let got = at(map, t);
                assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() <= 1), "{} at {t}: {got:?}, not {want:?}", map.name());
            }
        }
    }

    #[test]
    fn names_are_unique_and_found_again() {
        for map in ColorMap::ALL {
            assert_eq!(ColorMap::from_name(map.name()), Some(map));
        }
        assert_eq!(ColorMap::from_name("jet"), None);
    }

    #[test]
    fn points_rise_and_reach_both_ends() {
        for map in ColorMap::ALL {
            let points = map.spread(-1000.0, 3000.0);
            assert_eq!((points[0].0, points[points.len() - 1].0), (-1000.0, 3000.0));
            assert!(points.windows(2).all(|w| w[0].0 < w[1].0), "{}", map.name());
            let back = map.spread(1.0, 0.0);
            assert_eq!(back[0].1, points[points.len() - 1].1);
        }
    }
}
