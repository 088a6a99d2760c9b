"""Makes the USD files of the tests with OpenUSD's own writer (PyPI's usd-core 26.3 or later), in the folder of this script.

    python3 make.py

`floats` and `halves` have 40 Gaussians each, with attributes of both precisions; `old.usdc` is `floats` as an old version.
`stage` has transforms of all kinds, prims that are not drawn, and attributes that vary with time; `stage.json` has what
OpenUSD computes of it: the positions in the stage of the Gaussians that are drawn, in order, and their scales' products.
"""

import json
import os
import sys
from pathlib import Path

if len(sys.argv) == 3:
    os.environ["USD_WRITE_NEW_USDC_FILES_AS_VERSION"] = sys.argv[2]

from pxr import Gf, Sdf, Usd, UsdGeom, UsdUtils, Vt  # noqa: E402

FOLDER = Path(__file__).parent
COUNT = 40
TYPE = "ParticleField3DGaussianSplat"


def splat(stage, path, half=False, degree=1, count=COUNT):
    """A prim with `count` Gaussians, whose values are those of the Rust tests."""
    prim = stage.DefinePrim(path, TYPE)
    h = "h" if half else ""
    kinds = Sdf.ValueTypeNames
    vector, quaternion = (Gf.Vec3h, Gf.Quath) if half else (Gf.Vec3f, Gf.Quatf)
    vectors, quaternions, numbers = (
        (Vt.Vec3hArray, Vt.QuathArray, Vt.HalfArray) if half else (Vt.Vec3fArray, Vt.QuatfArray, Vt.FloatArray)
    )
    types = (kinds.Point3hArray, kinds.QuathArray, kinds.Half3Array, kinds.HalfArray) if half else (
        kinds.Point3fArray, kinds.QuatfArray, kinds.Float3Array, kinds.FloatArray)
    rows = range(count)
    values = {
        "positions": (types[0], vectors([vector(0.25 * i, -0.5 * i, 1 + 0.125 * i) for i in rows])),
        "orientations": (types[1], quaternions([quaternion(1, vector(0.5, -0.25, 0.125 * (i % 5))) for i in rows])),
        "scales": (types[2], vectors([vector(0.5, 0.25, 0.125 * (1 + i % 3)) for i in rows])),
        "opacities": (types[3], numbers([0.25 * (1 + i % 4) for i in rows])),
        "radiance:sphericalHarmonicsCoefficients": (
            types[2],
            vectors([vector(0.5 * k, -0.25 * k, 0.0625 * (i % 16)) for i in rows for k in range((degree + 1) ** 2)]),
        ),
    }
    for name, (kind, value) in values.items():
        prim.CreateAttribute(name + h, kind).Set(value)
    prim.CreateAttribute("radiance:sphericalHarmonicsDegree", kinds.Int, False, Sdf.VariabilityUniform).Set(degree)
    return prim


def save(stage, name):
    for extension in "usda", "usdc":
        stage.GetRootLayer().Export(str(FOLDER / f"{name}.{extension}"))


def simple(half):
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    splat(stage, "/splat", half)
    return stage


def transformed():
    """The stage of transforms."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 0.01)
    world = UsdGeom.Xform.Define(stage, "/world")
    world.AddTranslateOp().Set(Gf.Vec3d(1, 2, 3))
    world.AddRotateXYZOp().Set(Gf.Vec3f(10, 20, 30))
    world.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
    first = splat(stage, "/world/first", count=3)
    first.CreateAttribute("sortingModeHint", Sdf.ValueTypeNames.Token).Set("cameraDistance")
    xform = UsdGeom.Xformable(first)
    pivot = xform.AddTranslateOp(UsdGeom.XformOp.PrecisionFloat, "pivot")
    pivot.Set(Gf.Vec3f(5, 0, 0))
    xform.AddRotateZOp().Set(90.0)
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionFloat, "pivot", True)
    second = splat(stage, "/world/group/second", half=True, degree=0, count=3)
    xform = UsdGeom.Xformable(second)
    xform.AddOrientOp().Set(Gf.Quatf(0.5, 0.5, -0.5, 0.5))
    xform.AddTransformOp().Set(Gf.Matrix4d(0, 3, 0, 0, -3, 0, 0, 0, 0, 0, 3, 0, 4, 5, 6, 1))
    third = splat(stage, "/world/third", count=3)
    xform = UsdGeom.Xformable(third)
    xform.AddRotateZYXOp().Set(Gf.Vec3f(-40, 15, 5))
    xform.SetResetXformStack(True)
    opacities = third.GetAttribute("opacities")
    opacities.Set(Vt.FloatArray([0.5, 0.5, 0.5]), 1)
    opacities.Set(Vt.FloatArray([1, 1, 1]), 2)
    opacities.ClearDefault()
    for name in "invisible", "proxy", "inactive":
        prim = splat(stage, f"/world/{name}", count=3)
        if name == "invisible":
            UsdGeom.Imageable(prim).MakeInvisible()
        elif name == "proxy":
            UsdGeom.Imageable(prim).CreatePurposeAttr("proxy")
        else:
            prim.SetActive(False)
    stage.CreateClassPrim("/class")
    splat(stage, "/class/part", count=3)
    UsdGeom.Mesh.Define(stage, "/world/mesh")
    UsdGeom.Cube.Define(stage, "/world/cube").GetPrim().GetReferences().AddInternalReference("/class")
    cache = UsdGeom.XformCache(1)
    positions, volumes = [], []
    for prim in first, second, third:
        matrix = cache.GetLocalToWorldTransform(prim)
        points = prim.GetAttribute("positions").Get() or prim.GetAttribute("positionsh").Get()
        scales = prim.GetAttribute("scales").Get() or prim.GetAttribute("scalesh").Get()
        positions += [list(matrix.Transform(Gf.Vec3d(*point))) for point in points]
        factor = abs(matrix.ExtractRotationMatrix().GetDeterminant() and matrix.GetDeterminant3())
        volumes += [factor * scale[0] * scale[1] * scale[2] for scale in scales]
    (FOLDER / "stage.json").write_text(json.dumps({"positions": positions, "volumes": volumes}) + "\n")
    return stage


if len(sys.argv) == 3:
    stage = simple(False)
    stage.GetRootLayer().Export(sys.argv[1])
    sys.exit()
for name, made in ("floats", simple(False)), ("halves", simple(True)), ("stage", transformed()):
    save(made, name)
os.system(f"{sys.executable} {__file__} {FOLDER / 'old.usdc'} 0.4.0")
UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(FOLDER / "floats.usdc")), str(FOLDER / "package.usdz"))
