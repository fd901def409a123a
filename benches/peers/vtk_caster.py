"""VTK's ray casters, frame by frame on request.

usage: vtk_caster.py JOB.json

The job: `voxels` (a file of bytes, x fastest), `dimensions`, `spacing`, `table` (256 times red, green, blue, opacity per `unit` of
length), `unit`, `eye`, `target`, `up`, `height` of the view, `side` of the picture in pixels, `step` from sample to sample along a ray,
`threads`, `mapper` ("caster": the one for the CPU; "default": the one that VTK takes by default, in OpenGL), and `light` (none, or
`ambient`, `diffuse`, `specular`, `shininess` of a head light). Lengths are in the units of `spacing`; voxel (0,0,0) is at the origin.
Prints VTK's version; then for each line on the standard input: `frame` renders and prints seconds, `pixels FILE` writes the last
picture as RGBA bytes, row 0 on top, and prints `done`.
"""
import json
import pathlib
import sys
import time

import numpy
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy


def image(job):
    voxels = numpy.fromfile(job["voxels"], numpy.uint8)
    data = vtk.vtkImageData()
    data.SetDimensions(job["dimensions"])
    data.SetSpacing(job["spacing"])
    data.GetPointData().SetScalars(numpy_to_vtk(voxels, deep=True))
    return data


def looks(job):
    color, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    for value, (r, g, b, a) in enumerate(job["table"]):
        color.AddRGBPoint(value, r, g, b)
        opacity.AddPoint(value, a)
    looks = vtk.vtkVolumeProperty()
    looks.SetColor(color)
    looks.SetScalarOpacity(opacity)
    looks.SetScalarOpacityUnitDistance(job["unit"])
    looks.SetInterpolationTypeToLinear()
    looks.ShadeOff()
    if light := job.get("light"):
        looks.ShadeOn()
        looks.SetAmbient(light["ambient"])
        looks.SetDiffuse(light["diffuse"])
        looks.SetSpecular(light["specular"])
        looks.SetSpecularPower(light["shininess"])
    return looks


def caster(job):
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image(job))
    mapper.SetBlendModeToComposite()
    mapper.SetNumberOfThreads(job["threads"])
    # A ray for every pixel, samples as far apart as asked for.
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(job["step"])
    return mapper


def default(job):
    """What a pipeline gets that asks for no special mapper, where there is OpenGL: by llvmpipe, on a machine without a GPU."""
    mapper = vtk.vtkGPUVolumeRayCastMapper()
    mapper.SetInputData(image(job))
    mapper.SetBlendModeToComposite()
    mapper.LockSampleDistanceToInputSpacingOff()
    mapper.AutoAdjustSampleDistancesOff()
    mapper.UseJitteringOff()
    mapper.SetImageSampleDistance(1)
    mapper.SetSampleDistance(job["step"])
    return mapper


def window(job):
    volume = vtk.vtkVolume()
    volume.SetMapper(default(job) if job["mapper"] == "default" else caster(job))
    volume.SetProperty(looks(job))
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(0, 0, 0)
    renderer.AddVolume(volume)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetParallelScale(job["height"] / 2)
    camera.SetFocalPoint(job["target"])
    camera.SetPosition(job["eye"])
    camera.SetViewUp(job["up"])
    renderer.ResetCameraClippingRange()
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetMultiSamples(0)
    window.SetSize(job["side"], job["side"])
    window.AddRenderer(renderer)
    return window


def pixels(window, side):
    """The picture as RGBA, row 0 on top."""
    read = vtk.vtkWindowToImageFilter()
    read.SetInput(window)
    read.SetInputBufferTypeToRGBA()
    read.ReadFrontBufferOff()
    read.Update()
    return vtk_to_numpy(read.GetOutput().GetPointData().GetScalars()).reshape(side, side, 4)[::-1]


def main():
    job = json.loads(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8"))
    shown = window(job)
    shown.Render()
    driver = ""
    if job["mapper"] == "default":
        # "OpenGL renderer string:  llvmpipe (...)"
        told = [line for line in shown.ReportCapabilities().splitlines() if "renderer string" in line]
        driver = f", {shown.GetClassName()}, " + " ".join(told[0].split(":")[1:]).strip() if told else ""
    print(vtk.vtkVersion.GetVTKVersion() + driver, flush=True)
    for line in sys.stdin:
        order, _, file = line.rstrip("\n").partition(" ")
        if order == "pixels":
            pixels(shown, job["side"]).tofile(file)
            print("done", flush=True)
        else:
            start = time.perf_counter()
            shown.Render()
            if job["mapper"] == "default":
                # OpenGL may still be at work when the call comes back.
                shown.WaitForCompletion()
            print(time.perf_counter() - start, flush=True)


if __name__ == "__main__":
    main()
