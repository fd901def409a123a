//! Tags of the elements that are read, by the names of the standard.
//!
//! Source: DICOM PS3.6, chapter 6, <https://dicom.nema.org/medical/dicom/current/output/html/part06.html>.

/// Media Storage SOP Class UID: what kind of object the file holds.
pub(super) const MEDIA_CLASS: u32 = 0x0002_0002;
/// Transfer Syntax UID.
pub(super) const TRANSFER_SYNTAX: u32 = 0x0002_0010;
/// Image Type.
pub(super) const IMAGE_TYPE: u32 = 0x0008_0008;
/// SOP Class UID: what kind of object it is.
pub(super) const SOP_CLASS: u32 = 0x0008_0016;
/// SOP Instance UID: which object it is.
pub(super) const SOP_INSTANCE: u32 = 0x0008_0018;
/// Acquisition Time.
pub(super) const ACQUISITION_TIME: u32 = 0x0008_0032;
/// Modality.
pub(super) const MODALITY: u32 = 0x0008_0060;
/// Series Description.
pub(super) const SERIES_DESCRIPTION: u32 = 0x0008_103e;
/// Frame Type.
pub(super) const FRAME_TYPE: u32 = 0x0008_9007;
/// Slice Thickness.
pub(super) const SLICE_THICKNESS: u32 = 0x0018_0050;
/// Echo Time.
pub(super) const ECHO_TIME: u32 = 0x0018_0081;
/// Spacing Between Slices.
pub(super) const SPACING_BETWEEN_SLICES: u32 = 0x0018_0088;
/// Trigger Time.
pub(super) const TRIGGER_TIME: u32 = 0x0018_1060;
/// Imager Pixel Spacing: at the detector.
pub(super) const IMAGER_PIXEL_SPACING: u32 = 0x0018_1164;
/// Nominal Scanned Pixel Spacing.
pub(super) const NOMINAL_PIXEL_SPACING: u32 = 0x0018_2010;
/// Diffusion Gradient Direction Sequence.
pub(super) const GRADIENT: u32 = 0x0018_9076;
/// Effective Echo Time.
pub(super) const EFFECTIVE_ECHO_TIME: u32 = 0x0018_9082;
/// Diffusion b-value.
pub(super) const B_VALUE: u32 = 0x0018_9087;
/// Diffusion Gradient Orientation.
pub(super) const GRADIENT_ORIENTATION: u32 = 0x0018_9089;
/// MR Echo Sequence.
pub(super) const ECHO: u32 = 0x0018_9114;
/// MR Diffusion Sequence.
pub(super) const DIFFUSION: u32 = 0x0018_9117;
/// Cardiac Synchronization Sequence.
pub(super) const CARDIAC: u32 = 0x0018_9118;
/// MR Image Frame Type Sequence.
pub(super) const MR_FRAME_TYPE: u32 = 0x0018_9226;
/// CT Image Frame Type Sequence.
pub(super) const CT_FRAME_TYPE: u32 = 0x0018_9329;
/// Series Instance UID.
pub(super) const SERIES: u32 = 0x0020_000e;
/// Series Number.
pub(super) const SERIES_NUMBER: u32 = 0x0020_0011;
/// Acquisition Number.
pub(super) const ACQUISITION_NUMBER: u32 = 0x0020_0012;
/// Instance Number.
pub(super) const INSTANCE_NUMBER: u32 = 0x0020_0013;
/// Image Position (Patient).
pub(super) const POSITION: u32 = 0x0020_0032;
/// Image Orientation (Patient).
pub(super) const ORIENTATION: u32 = 0x0020_0037;
/// Temporal Position Identifier.
pub(super) const TEMPORAL_POSITION: u32 = 0x0020_0100;
/// Slice Location.
pub(super) const SLICE_LOCATION: u32 = 0x0020_1041;
/// Frame Content Sequence.
pub(super) const FRAME_CONTENT: u32 = 0x0020_9111;
/// Plane Position Sequence.
pub(super) const PLANE_POSITION: u32 = 0x0020_9113;
/// Plane Orientation Sequence.
pub(super) const PLANE_ORIENTATION: u32 = 0x0020_9116;
/// Temporal Position Index.
pub(super) const TEMPORAL_INDEX: u32 = 0x0020_9128;
/// Nominal Cardiac Trigger Delay Time.
pub(super) const TRIGGER_DELAY: u32 = 0x0020_9153;
/// Frame Acquisition Number.
pub(super) const FRAME_ACQUISITION_NUMBER: u32 = 0x0020_9156;
/// Samples per Pixel.
pub(super) const SAMPLES: u32 = 0x0028_0002;
/// Photometric Interpretation.
pub(super) const PHOTOMETRIC: u32 = 0x0028_0004;
/// Planar Configuration.
pub(super) const PLANAR: u32 = 0x0028_0006;
/// Number of Frames.
pub(super) const NUMBER_OF_FRAMES: u32 = 0x0028_0008;
/// Rows.
pub(super) const ROWS: u32 = 0x0028_0010;
/// Columns.
pub(super) const COLUMNS: u32 = 0x0028_0011;
/// Pixel Spacing.
pub(super) const PIXEL_SPACING: u32 = 0x0028_0030;
/// Pixel Aspect Ratio: the height of a pixel and its width, without a unit.
pub(super) const PIXEL_ASPECT: u32 = 0x0028_0034;
/// Bits Allocated.
pub(super) const BITS_ALLOCATED: u32 = 0x0028_0100;
/// Bits Stored.
pub(super) const BITS_STORED: u32 = 0x0028_0101;
/// High Bit.
pub(super) const HIGH_BIT: u32 = 0x0028_0102;
/// Pixel Representation: whether numbers have a sign.
pub(super) const PIXEL_REPRESENTATION: u32 = 0x0028_0103;
/// Pixel Padding Value.
pub(super) const PIXEL_PADDING: u32 = 0x0028_0120;
/// Rescale Intercept.
pub(super) const RESCALE_INTERCEPT: u32 = 0x0028_1052;
/// Rescale Slope.
pub(super) const RESCALE_SLOPE: u32 = 0x0028_1053;
/// Rescale Type.
pub(super) const RESCALE_TYPE: u32 = 0x0028_1054;
/// Red Palette Color Lookup Table Descriptor; those of green and blue follow.
pub(super) const RED_DESCRIPTOR: u32 = 0x0028_1101;
pub(super) const GREEN_DESCRIPTOR: u32 = 0x0028_1102;
pub(super) const BLUE_DESCRIPTOR: u32 = 0x0028_1103;
/// Red Palette Color Lookup Table Data; those of green and blue follow.
pub(super) const RED_DATA: u32 = 0x0028_1201;
pub(super) const GREEN_DATA: u32 = 0x0028_1202;
pub(super) const BLUE_DATA: u32 = 0x0028_1203;
/// Modality LUT Sequence: a table in place of a slope.
pub(super) const MODALITY_LUT: u32 = 0x0028_3000;
/// Pixel Measures Sequence.
pub(super) const PIXEL_MEASURES: u32 = 0x0028_9110;
/// Pixel Value Transformation Sequence.
pub(super) const PIXEL_VALUES: u32 = 0x0028_9145;
/// Detector Information Sequence.
pub(super) const DETECTOR: u32 = 0x0054_0022;
/// Grid Frame Offset Vector: where the frames of a dose grid lie along the normal.
pub(super) const GRID_OFFSETS: u32 = 0x3004_000c;
/// Dose Grid Scaling: the slope of a dose grid.
pub(super) const DOSE_SCALING: u32 = 0x3004_000e;
/// Shared Functional Groups Sequence: what is said of all frames.
pub(super) const SHARED: u32 = 0x5200_9229;
/// Per-Frame Functional Groups Sequence: what is said of each frame.
pub(super) const FRAMES: u32 = 0x5200_9230;

/// Names of the tags that messages may be about.
const NAMES: [(u32, &str); 68] = [
    (MEDIA_CLASS, "Media Storage SOP Class UID"),
    (TRANSFER_SYNTAX, "Transfer Syntax UID"),
    (IMAGE_TYPE, "Image Type"),
    (SOP_CLASS, "SOP Class UID"),
    (SOP_INSTANCE, "SOP Instance UID"),
    (ACQUISITION_TIME, "Acquisition Time"),
    (MODALITY, "Modality"),
    (SERIES_DESCRIPTION, "Series Description"),
    (FRAME_TYPE, "Frame Type"),
    (SLICE_THICKNESS, "Slice Thickness"),
    (ECHO_TIME, "Echo Time"),
    (SPACING_BETWEEN_SLICES, "Spacing Between Slices"),
    (TRIGGER_TIME, "Trigger Time"),
    (IMAGER_PIXEL_SPACING, "Imager Pixel Spacing"),
    (NOMINAL_PIXEL_SPACING, "Nominal Scanned Pixel Spacing"),
    (GRADIENT, "Diffusion Gradient Direction Sequence"),
    (EFFECTIVE_ECHO_TIME, "Effective Echo Time"),
    (B_VALUE, "Diffusion b-value"),
    (GRADIENT_ORIENTATION, "Diffusion Gradient Orientation"),
    (ECHO, "MR Echo Sequence"),
    (DIFFUSION, "MR Diffusion Sequence"),
    (CARDIAC, "Cardiac Synchronization Sequence"),
    (MR_FRAME_TYPE, "MR Image Frame Type Sequence"),
    (CT_FRAME_TYPE, "CT Image Frame Type Sequence"),
    (SERIES, "Series Instance UID"),
    (SERIES_NUMBER, "Series Number"),
    (ACQUISITION_NUMBER, "Acquisition Number"),
    (INSTANCE_NUMBER, "Instance Number"),
    (POSITION, "Image Position (Patient)"),
    (ORIENTATION, "Image Orientation (Patient)"),
    (TEMPORAL_POSITION, "Temporal Position Identifier"),
    (SLICE_LOCATION, "Slice Location"),
    (FRAME_CONTENT, "Frame Content Sequence"),
    (PLANE_POSITION, "Plane Position Sequence"),
    (PLANE_ORIENTATION, "Plane Orientation Sequence"),
    (TEMPORAL_INDEX, "Temporal Position Index"),
    (TRIGGER_DELAY, "Nominal Cardiac Trigger Delay Time"),
    (FRAME_ACQUISITION_NUMBER, "Frame Acquisition Number"),
    (SAMPLES, "Samples per Pixel"),
    (PHOTOMETRIC, "Photometric Interpretation"),
    (PLANAR, "Planar Configuration"),
    (NUMBER_OF_FRAMES, "Number of Frames"),
    (ROWS, "Rows"),
    (COLUMNS, "Columns"),
    (PIXEL_SPACING, "Pixel Spacing"),
    (PIXEL_ASPECT, "Pixel Aspect Ratio"),
    (BITS_ALLOCATED, "Bits Allocated"),
    (BITS_STORED, "Bits Stored"),
    (HIGH_BIT, "High Bit"),
    (PIXEL_REPRESENTATION, "Pixel Representation"),
    (PIXEL_PADDING, "Pixel Padding Value"),
    (RESCALE_INTERCEPT, "Rescale Intercept"),
    (RESCALE_SLOPE, "Rescale Slope"),
    (RESCALE_TYPE, "Rescale Type"),
    (MODALITY_LUT, "Modality LUT Sequence"),
    (PIXEL_MEASURES, "Pixel Measures Sequence"),
    (PIXEL_VALUES, "Pixel Value Transformation Sequence"),
    (DETECTOR, "Detector Information Sequence"),
    (GRID_OFFSETS, "Grid Frame Offset Vector"),
    (DOSE_SCALING, "Dose Grid Scaling"),
    (SHARED, "Shared Functional Groups Sequence"),
    (FRAMES, "Per-Frame Functional Groups Sequence"),
    (RED_DESCRIPTOR, "Red Palette Color Lookup Table Descriptor"),
    (GREEN_DESCRIPTOR, "Green Palette Color Lookup Table Descriptor"),
    (BLUE_DESCRIPTOR, "Blue Palette Color Lookup Table Descriptor"),
    (RED_DATA, "Red Palette Color Lookup Table Data"),
    (GREEN_DATA, "Green Palette Color Lookup Table Data"),
    (BLUE_DATA, "Blue Palette Color Lookup Table Data"),
];

/// A tag as it is usually written, behind its name where it is one of these.
pub(super) fn shown(tag: u32) -> String {
    let number = format!("({:04X},{:04X})", tag >> 16, tag & 0xffff);
    NAMES.iter().find(|(known, _)| *known == tag).map_or_else(|| number.clone(), |(_, name)| format!("{name} {number}"))
}
