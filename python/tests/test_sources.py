"""Images of other libraries stand where those say they do."""

import numpy as np
import pytest

import slicestack
from conftest import field, transfer

KEYS = {"transfer": transfer(-20000, 30000), "size": 40, "count": 40, "azimuth": 30, "elevation": 15}


def test_simpleitk(tmp_path):
    sitk = pytest.importorskip("SimpleITK")
    image = sitk.GetImageFromArray(field((8, 9, 10), "i2"))
    image.SetSpacing((0.5, 1.5, 2.0))
    image.SetOrigin((3, -4, 5))
    image.SetDirection((0, -1, 0, 1, 0, 0, 0, 0, 1))
    sitk.WriteImage(image, str(tmp_path / "a.nrrd"))
    volume = slicestack.Volume(image)
    assert volume.is_shared and volume.space == "lps"
    for index in ((0, 0, 0), (9, 8, 7), (2, 5, 1)):
        np.testing.assert_allclose((volume.affine @ [*index, 1])[:3], image.TransformIndexToPhysicalPoint(index))
    assert slicestack.render(image, **KEYS) == slicestack.render(tmp_path / "a.nrrd", **KEYS)


def test_nibabel(tmp_path):
    nib = pytest.importorskip("nibabel")
    affine = np.array([[0, -1.5, 0, 4], [2, 0.1, 0, 5], [0, 0, 3, 6], [0, 0, 0, 1.0]])
    image = nib.Nifti1Image(np.asfortranarray(field((10, 9, 8), "i2")), affine)
    nib.save(image, tmp_path / "a.nii")
    volume = slicestack.Volume(nib.load(tmp_path / "a.nii"))
    assert volume.space == "ras" and volume.shape == (8, 9, 10) and not volume.copied
    np.testing.assert_allclose(volume.affine, affine)
    assert slicestack.render(volume, **KEYS) == slicestack.render(tmp_path / "a.nii", **KEYS)
    # Scaled: the slope goes beside the stored integers.
    image.header.set_slope_inter(0.5, 7)
    nib.save(image, tmp_path / "b.nii")
    scaled = slicestack.Volume(nib.load(tmp_path / "b.nii"))
    other = slicestack.Volume.open(tmp_path / "b.nii")
    assert scaled.rescale == other.rescale and scaled.dtype == other.dtype
    assert slicestack.render(scaled, **KEYS) == slicestack.render(other, **KEYS)


def test_xarray():
    xr = pytest.importorskip("xarray")
    coords = {"z": np.arange(6) * 2.0 + 1, "y": ("y", np.arange(7) * 0.5, {"units": "um"}), "x": np.arange(8) * -0.25}
    data = xr.DataArray(field((6, 7, 8), "u2"), dims=("z", "y", "x"), coords=coords, name="waves")
    volume = slicestack.Volume(data)
    assert volume.is_shared and volume.spacing == (0.25, 0.5, 2) and volume.origin == (0, 0, 1) and volume.name == "waves"
    np.testing.assert_allclose(np.diag(volume.affine), [-0.25, 0.5, 2, 1])
    with pytest.raises(ValueError, match="xarray: z: its coordinates are not evenly spaced"):
        slicestack.Volume(data.assign_coords(z=[0, 1, 2, 3, 4, 9.0]))


def test_pydicom(tmp_path):
    pydicom = pytest.importorskip("pydicom")
    from pydicom.dataset import Dataset, FileMetaDataset
    from pydicom.uid import CTImageStorage, ExplicitVRLittleEndian, generate_uid

    values, series, frame = field((5, 6, 7), "i2") // 40, generate_uid(), generate_uid()
    slices = []
    for n, plane in enumerate(values):
        d = Dataset()
        d.file_meta = FileMetaDataset()
        d.file_meta.TransferSyntaxUID, d.file_meta.MediaStorageSOPClassUID = ExplicitVRLittleEndian, CTImageStorage
        d.SOPClassUID, d.SOPInstanceUID, d.SeriesInstanceUID, d.StudyInstanceUID = CTImageStorage, generate_uid(), series, series
        d.file_meta.MediaStorageSOPInstanceUID, d.FrameOfReferenceUID = d.SOPInstanceUID, frame
        d.Modality, d.InstanceNumber = "CT", n + 1
        d.Rows, d.Columns = plane.shape
        d.ImageOrientationPatient, d.PixelSpacing = [0, 1, 0, 0, 0, -1], [0.5, 1.5]
        d.ImagePositionPatient = [-3.0 * n + 2, 1, 7]
        d.RescaleSlope, d.RescaleIntercept = 2, -1000
        d.SamplesPerPixel, d.PhotometricInterpretation, d.BitsAllocated, d.BitsStored, d.HighBit, d.PixelRepresentation = 1, "MONOCHROME2", 16, 16, 15, 1
        d.PixelData = np.ascontiguousarray(plane).tobytes()
        pydicom.dcmwrite(tmp_path / f"{n}.dcm", d, enforce_file_format=True)
        slices.append(pydicom.dcmread(tmp_path / f"{n}.dcm"))
    volume, other = slicestack.Volume(slices[::-1]), slicestack.Volume.open(tmp_path)
    np.testing.assert_allclose(volume.affine, other.affine, atol=1e-9)
    assert volume.rescale == other.rescale == (2, -1000)
    keys = {**KEYS, "transfer": transfer(-3000, 1500)}
    assert slicestack.render(volume, **keys).compare(slicestack.render(other, **keys))["max"] < 1e-5
    slices[2].PixelSpacing = [0.5, 1.6]
    with pytest.raises(ValueError, match="pydicom: PixelSpacing differs between slices"):
        slicestack.Volume(slices)
