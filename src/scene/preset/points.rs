//! The points of every preset.
//!
//! Those for CT were placed by what tissues measure: air -1000, lung -900 to -600, fat -120 to -60, water 0, muscle 40 to 70, clotted blood 50 to
//! 80, organs with contrast agent 80 to 150, vessels with it 150 to 450, spongy bone 150 to 400, dense bone from 500 up.

use super::Preset;

pub(super) type Colors = &'static [(f64, [f64; 3])];
pub(super) type Opacities = &'static [(f64, f64)];

/// What the values of a preset's points mean, and the length that its opacities refer to.
pub(super) enum Scale {
    /// Hounsfield units, opacity per mm; gradients in Hounsfield units per mm.
    Hounsfield,
    /// Positions of [`super::Landmarks::at`], opacity per smallest voxel spacing.
    Voxel,
    /// Positions of [`super::Landmarks::at`], opacity per hundredth of the box's diagonal: the same picture at any resolution.
    Box,
}

/// A preset's points.
pub(super) struct Points {
    pub(super) scale: Scale,
    pub(super) color: Colors,
    pub(super) opacity: Opacities,
    /// Factor on the opacity by the size of the gradient; empty where it does not count.
    pub(super) gradient: Opacities,
}

fn ct(color: Colors, opacity: Opacities) -> Points {
    Points { scale: Scale::Hounsfield, color, opacity, gradient: &[] }
}

/// CT whose opacity depends on the gradient too.
fn ct_edges(color: Colors, opacity: Opacities, gradient: Opacities) -> Points {
    Points { scale: Scale::Hounsfield, color, opacity, gradient }
}

fn voxel(color: Colors, opacity: Opacities) -> Points {
    Points { scale: Scale::Voxel, color, opacity, gradient: &[] }
}

fn in_box(color: Colors, opacity: Opacities) -> Points {
    Points { scale: Scale::Box, color, opacity, gradient: &[] }
}

impl Preset {
    pub(super) fn points(self) -> Points {
        match self {
            Self::CtBone => ct(BONE_COLOR, &[(150.0, 0.0), (250.0, 0.06), (450.0, 0.3), (900.0, 0.5), (1500.0, 0.7)]),
            Self::CtSkinBone => ct(
                SKIN_BONE_COLOR,
                &[
                    (-620.0, 0.0),
                    (-400.0, 0.06),
                    (-180.0, 0.05),
                    (-100.0, 0.003),
                    (120.0, 0.004),
                    (200.0, 0.02),
                    (450.0, 0.25),
                    (1000.0, 0.6),
                ],
            ),
            Self::CtSoftTissue => ct(SOFT_COLOR, &[(-30.0, 0.0), (10.0, 0.008), (50.0, 0.03), (120.0, 0.06), (250.0, 0.1), (1000.0, 0.2)]),
            Self::CtLung => {
                ct(LUNG_COLOR, &[(-960.0, 0.0), (-900.0, 0.012), (-750.0, 0.02), (-600.0, 0.05), (-450.0, 0.0), (0.0, 0.0), (300.0, 0.01)])
            }
            Self::CtAngio => ct(ANGIO_COLOR, &[(110.0, 0.0), (170.0, 0.04), (300.0, 0.2), (420.0, 0.15), (600.0, 0.06), (1500.0, 0.12)]),
            // The lumen dense and red, chalk in its wall white, the spine held back.
            Self::CtAaa => {
                ct(AAA_COLOR, &[(130.0, 0.0), (170.0, 0.05), (230.0, 0.3), (330.0, 0.35), (450.0, 0.08), (700.0, 0.1), (1100.0, 0.5)])
            }
            // Only where values change: the shell of bones, so that the inside is seen through it.
            Self::CtBones => ct_edges(
                BONES_COLOR,
                &[(120.0, 0.0), (180.0, 0.06), (300.0, 0.2), (600.0, 0.35), (1200.0, 0.6)],
                &[(0.0, 0.05), (20.0, 0.15), (60.0, 0.8), (120.0, 1.0)],
            ),
            // Muscle of the heart as a veil over the blood in its chambers.
            Self::CtCardiac => ct(
                CARDIAC_COLOR,
                &[(60.0, 0.0), (90.0, 0.012), (140.0, 0.02), (180.0, 0.06), (280.0, 0.2), (420.0, 0.2), (550.0, 0.04), (1000.0, 0.08)],
            ),
            // Great vessels and heart, the vessels of the lungs, ribs behind them.
            Self::CtChestContrast => ct(
                CHEST_COLOR,
                &[
                    (-700.0, 0.0),
                    (-550.0, 0.004),
                    (-300.0, 0.01),
                    (-150.0, 0.0),
                    (10.0, 0.0),
                    (60.0, 0.002),
                    (120.0, 0.02),
                    (200.0, 0.15),
                    (350.0, 0.25),
                    (500.0, 0.12),
                    (1000.0, 0.3),
                ],
            ),
            // Narrow vessels need a steep curve; the shell of chambers is kept by the gradient, their inside let through.
            Self::CtCoronary => ct_edges(
                CORONARY_COLOR,
                &[(140.0, 0.0), (190.0, 0.08), (260.0, 0.4), (420.0, 0.5), (600.0, 0.3), (1000.0, 0.6)],
                &[(0.0, 0.05), (25.0, 0.2), (70.0, 1.0)],
            ),
            Self::CtFat => ct_edges(
                FAT_COLOR,
                &[(-160.0, 0.0), (-130.0, 0.006), (-105.0, 0.02), (-80.0, 0.012), (-50.0, 0.0), (200.0, 0.0), (400.0, 0.08), (1200.0, 0.3)],
                &[(0.0, 1.0), (40.0, 0.8), (120.0, 0.25)],
            ),
            // The liver as a veil, its vessels dense in it.
            Self::CtLiverVessels => ct(
                LIVER_COLOR,
                &[(60.0, 0.0), (80.0, 0.008), (110.0, 0.02), (135.0, 0.05), (170.0, 0.22), (230.0, 0.22), (300.0, 0.05), (1000.0, 0.1)],
            ),
            Self::CtMip => ct(MIP_COLOR, &[(-950.0, 0.0), (-200.0, 0.1), (50.0, 0.3), (200.0, 1.0)]),
            Self::CtMuscle => ct_edges(
                MUSCLE_COLOR,
                &[(-10.0, 0.0), (15.0, 0.02), (45.0, 0.1), (75.0, 0.14), (110.0, 0.08), (180.0, 0.1), (400.0, 0.4), (1000.0, 0.7)],
                &[(0.0, 0.3), (10.0, 0.5), (40.0, 1.0)],
            ),
            // Vessels are thin, so that they reach these values alone; steep edges are those of the skin and are left out.
            Self::CtPulmonary => ct_edges(
                PULMONARY_COLOR,
                &[(-950.0, 0.0), (-880.0, 0.004), (-800.0, 0.01), (-740.0, 0.06), (-640.0, 0.08), (-560.0, 0.0)],
                &[(0.0, 1.0), (150.0, 0.6), (300.0, 0.05)],
            ),
            // Only walls around air: the gradient leaves out air itself, in the body and around it.
            Self::CtAir => ct_edges(
                AIR_COLOR,
                &[(-1000.0, 0.05), (-850.0, 0.1), (-600.0, 0.08), (-400.0, 0.03), (-250.0, 0.0)],
                &[(0.0, 0.0), (40.0, 0.0), (120.0, 0.5), (250.0, 1.0)],
            ),
            Self::MrBrain => voxel(BRAIN_COLOR, &[(-0.5, 0.0), (-0.1, 0.02), (0.2, 0.06), (0.6, 0.15), (1.0, 0.35)]),
            Self::MrAngio => voxel(VESSEL_COLOR, &[(-0.6, 0.0), (0.0, 0.002), (0.45, 0.006), (0.7, 0.1), (1.0, 0.5)]),
            Self::MrDefault => voxel(MR_COLOR, &[(-0.4, 0.0), (0.0, 0.03), (0.3, 0.12), (0.7, 0.35), (1.0, 0.6)]),
            Self::MrMip => voxel(MR_MIP_COLOR, &[(-0.9, 0.0), (0.0, 0.3), (0.6, 0.8), (1.0, 1.0)]),
            // Brain as a veil, water and what shines like it dense in it.
            Self::MrT2Brain => voxel(T2_COLOR, &[(-0.4, 0.0), (-0.1, 0.015), (0.3, 0.03), (0.55, 0.04), (0.75, 0.25), (1.0, 0.5)]),
            Self::DtiFa => voxel(FA_COLOR, &[(0.1, 0.0), (0.3, 0.02), (0.5, 0.12), (0.75, 0.35), (1.0, 0.7)]),
            Self::GreyRamp => in_box(GREY_COLOR, RAMP),
            Self::XRay => in_box(WHITE, &[(-1.0, 0.0), (0.0, 0.004), (0.3, 0.007), (1.0, 0.05)]),
            Self::HotRamp => in_box(&[], &[(-0.85, 0.0), (0.0, 0.05), (0.5, 0.18), (1.0, 0.5)]),
            Self::ViridisRamp => in_box(&[], RAMP),
        }
    }
}

const RAMP: Opacities = &[(-0.6, 0.0), (0.0, 0.04), (0.5, 0.18), (1.0, 0.5)];
const WHITE: Colors = &[(0.0, [1.0, 1.0, 1.0])];
const GREY_COLOR: Colors = &[(-0.8, [0.05, 0.05, 0.05]), (0.0, [0.4, 0.4, 0.4]), (1.0, [1.0, 1.0, 1.0])];
const BONE_COLOR: Colors = &[
    (150.0, [0.25, 0.11, 0.06]),
    (280.0, [0.55, 0.36, 0.23]),
    (500.0, [0.84, 0.70, 0.53]),
    (1000.0, [0.98, 0.93, 0.84]),
    (1800.0, [1.0, 1.0, 0.97]),
];
const SKIN_BONE_COLOR: Colors = &[
    (-600.0, [0.30, 0.10, 0.06]),
    (-350.0, [0.80, 0.45, 0.32]),
    (-100.0, [0.95, 0.68, 0.52]),
    (60.0, [0.75, 0.28, 0.20]),
    (200.0, [0.60, 0.42, 0.28]),
    (450.0, [0.90, 0.78, 0.60]),
    (1000.0, [1.0, 0.97, 0.90]),
];
const SOFT_COLOR: Colors = &[
    (-30.0, [0.45, 0.15, 0.10]),
    (40.0, [0.72, 0.28, 0.20]),
    (110.0, [0.92, 0.52, 0.38]),
    (250.0, [0.95, 0.80, 0.62]),
    (1000.0, [1.0, 0.98, 0.92]),
];
const LUNG_COLOR: Colors = &[
    (-960.0, [0.15, 0.30, 0.55]),
    (-800.0, [0.35, 0.55, 0.80]),
    (-600.0, [0.90, 0.60, 0.50]),
    (-450.0, [0.95, 0.75, 0.65]),
    (300.0, [0.95, 0.92, 0.85]),
];
const ANGIO_COLOR: Colors = &[
    (110.0, [0.40, 0.05, 0.04]),
    (200.0, [0.75, 0.12, 0.08]),
    (350.0, [0.95, 0.35, 0.20]),
    (500.0, [0.90, 0.78, 0.60]),
    (1500.0, [1.0, 0.97, 0.90]),
];
const BRAIN_COLOR: Colors = &[
    (-0.5, [0.18, 0.08, 0.07]),
    (0.0, [0.46, 0.26, 0.22]),
    (0.45, [0.82, 0.62, 0.52]),
    (0.8, [0.95, 0.87, 0.78]),
    (1.0, [1.0, 1.0, 0.97]),
];
const VESSEL_COLOR: Colors = &[(-0.6, [0.20, 0.20, 0.28]), (0.45, [0.45, 0.42, 0.50]), (0.7, [0.90, 0.25, 0.15]), (1.0, [1.0, 0.85, 0.60])];
const AAA_COLOR: Colors = &[
    (130.0, [0.45, 0.12, 0.08]),
    (220.0, [0.85, 0.16, 0.10]),
    (330.0, [0.98, 0.42, 0.22]),
    (450.0, [0.85, 0.72, 0.56]),
    (700.0, [0.94, 0.88, 0.76]),
    (1100.0, [1.0, 1.0, 0.96]),
];
const BONES_COLOR: Colors =
    &[(120.0, [0.55, 0.26, 0.18]), (220.0, [0.78, 0.56, 0.38]), (400.0, [0.92, 0.82, 0.62]), (900.0, [0.99, 0.96, 0.88])];
const CARDIAC_COLOR: Colors = &[
    (60.0, [0.45, 0.12, 0.10]),
    (140.0, [0.75, 0.24, 0.18]),
    (220.0, [0.95, 0.48, 0.20]),
    (380.0, [1.0, 0.80, 0.42]),
    (550.0, [0.92, 0.86, 0.74]),
    (1000.0, [1.0, 0.98, 0.92]),
];
const CHEST_COLOR: Colors = &[
    (-700.0, [0.30, 0.48, 0.75]),
    (-300.0, [0.60, 0.70, 0.88]),
    (60.0, [0.60, 0.20, 0.16]),
    (180.0, [0.85, 0.22, 0.14]),
    (350.0, [1.0, 0.55, 0.30]),
    (500.0, [0.92, 0.82, 0.66]),
    (1000.0, [1.0, 0.97, 0.90]),
];
const CORONARY_COLOR: Colors = &[
    (140.0, [0.55, 0.10, 0.08]),
    (250.0, [0.90, 0.22, 0.12]),
    (420.0, [1.0, 0.62, 0.34]),
    (600.0, [1.0, 0.94, 0.84]),
    (1000.0, [1.0, 1.0, 1.0]),
];
const FAT_COLOR: Colors = &[
    (-160.0, [0.80, 0.55, 0.16]),
    (-110.0, [0.98, 0.84, 0.42]),
    (-40.0, [0.90, 0.55, 0.30]),
    (250.0, [0.85, 0.78, 0.70]),
    (1200.0, [1.0, 0.98, 0.94]),
];
const LIVER_COLOR: Colors = &[
    (60.0, [0.40, 0.16, 0.10]),
    (110.0, [0.66, 0.32, 0.22]),
    (140.0, [0.35, 0.45, 0.85]),
    (200.0, [0.50, 0.68, 0.98]),
    (260.0, [0.85, 0.90, 1.0]),
    (380.0, [0.88, 0.82, 0.70]),
    (1000.0, [1.0, 0.97, 0.90]),
];
const MIP_COLOR: Colors = &[(-200.0, [0.0, 0.0, 0.0]), (50.0, [0.22, 0.22, 0.22]), (600.0, [0.85, 0.85, 0.85]), (1200.0, [1.0, 1.0, 1.0])];
const MUSCLE_COLOR: Colors = &[
    (-20.0, [0.85, 0.62, 0.48]),
    (10.0, [0.35, 0.07, 0.06]),
    (45.0, [0.62, 0.17, 0.13]),
    (70.0, [0.85, 0.38, 0.30]),
    (120.0, [0.95, 0.70, 0.56]),
    (300.0, [0.92, 0.82, 0.66]),
    (1000.0, [1.0, 0.97, 0.90]),
];
const PULMONARY_COLOR: Colors =
    &[(-950.0, [0.20, 0.35, 0.65]), (-820.0, [0.35, 0.55, 0.85]), (-720.0, [0.95, 0.45, 0.30]), (-550.0, [0.90, 0.25, 0.15])];
const AIR_COLOR: Colors =
    &[(-1000.0, [0.35, 0.70, 0.95]), (-800.0, [0.45, 0.80, 0.95]), (-550.0, [0.75, 0.90, 0.95]), (-250.0, [0.95, 0.90, 0.85])];
const MR_COLOR: Colors = &[(-0.4, [0.12, 0.10, 0.10]), (0.0, [0.38, 0.34, 0.32]), (0.5, [0.76, 0.70, 0.64]), (1.0, [1.0, 0.98, 0.94])];
const MR_MIP_COLOR: Colors = &[(-0.9, [0.0, 0.0, 0.0]), (0.0, [0.3, 0.3, 0.3]), (1.0, [1.0, 1.0, 1.0])];
const T2_COLOR: Colors = &[
    (-0.4, [0.30, 0.18, 0.16]),
    (0.1, [0.70, 0.50, 0.44]),
    (0.55, [0.85, 0.70, 0.62]),
    (0.75, [0.45, 0.72, 0.95]),
    (1.0, [0.92, 0.97, 1.0]),
];
const FA_COLOR: Colors = &[
    (0.1, [0.10, 0.14, 0.45]),
    (0.35, [0.15, 0.50, 0.75]),
    (0.6, [0.95, 0.80, 0.25]),
    (0.85, [0.95, 0.40, 0.12]),
    (1.0, [1.0, 0.90, 0.80]),
];
