"""Makes the USD files of the tests with OpenUSD's own writer (PyPI's usd-core 26.3 or later), in the folder of this script.

    python3 make.py

`floats` and `halves` have 40 Gaussians each, with attributes of both precisions; `old.usdc` is `floats` as an old version.
`stage` has transforms of all kinds, prims that are not drawn, and attributes that vary with time; the folder `composed` has a
stage of several layers, `root`. `stage.json` and `composed/root.json` have what OpenUSD computes of them: the positions in the
stage of the Gaussians that are drawn, in order, and their scales' products. `surflets` is a field of 2D Gaussians.
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
    part = stage.GetPrimAtPath("/world/cube/part")
    expect(FOLDER / "stage.json", (first, second, third, part))
    return stage


def expect(path, prims):
    """Writes the positions in the stage and the volumes of the Gaussians of `prims`."""
    cache = UsdGeom.XformCache(1)
    positions, volumes = [], []
    for prim in prims:
        matrix = cache.GetLocalToWorldTransform(prim)
        points = prim.GetAttribute("positions").Get() or prim.GetAttribute("positionsh").Get()
        scales = prim.GetAttribute("scales").Get() or prim.GetAttribute("scalesh").Get()
        positions += [list(matrix.Transform(Gf.Vec3d(*point))) for point in points]
        factor = abs(matrix.ExtractRotationMatrix().GetDeterminant() and matrix.GetDeterminant3())
        volumes += [factor * scale[0] * scale[1] * scale[2] for scale in scales]
    path.write_text(json.dumps({"positions": positions, "volumes": volumes}) + "\n")


def layer(name):
    """An empty stage that is the file `name` of the folder `composed`."""
    path = FOLDER / "composed" / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.unlink(missing_ok=True)
    stage = Usd.Stage.CreateNew(str(path))
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    return stage


def moved(prim, *offset):
    translation = prim.GetAttribute("xformOp:translate") or UsdGeom.Xformable(prim).AddTranslateOp().GetAttr()
    translation.Set(Gf.Vec3d(*offset))


def composed():
    """A stage of several layers, in which each way of composition has a part."""
    part = layer("part.usdc")
    part.SetDefaultPrim(UsdGeom.Xform.Define(part, "/part").GetPrim())
    splat(part, "/part/body", count=2)
    moved(splat(part, "/part/detail", half=True, count=1), 0, 0, 7)
    other = part.DefinePrim("/other", "Xform")
    lod = other.GetVariantSets().AddVariantSet("lod")
    for name, count in ("high", 4), ("low", 1):
        lod.AddVariant(name)
        lod.SetVariantSelection(name)
        with lod.GetVariantEditContext():
            splat(part, f"/other/{name}", count=count)
            moved(other, 0, count, 0)
    part.Save()
    nested = layer("nested/group.usda")
    nested.SetDefaultPrim(nested.DefinePrim("/group", "Xform"))
    nested.DefinePrim("/group/inner", "Xform").GetReferences().AddReference("../part.usdc", "/other")
    nested.Save()
    below = layer("below.usda")
    splat(below, "/world/of_sublayer", count=1)
    moved(splat(below, "/world/moved", count=1), 100, 0, 0)
    below.Save()
    UsdUtils.CreateNewUsdzPackage(
        Sdf.AssetPath(str(FOLDER / "composed/part.usdc")), str(FOLDER / "composed/package.usdz"))
    for extension in "usda", "usdc":
        root = layer(f"root.{extension}")
        root.GetRootLayer().subLayerPaths.append("./below.usda")
        world = UsdGeom.Xform.Define(root, "/world")
        world.AddScaleOp().Set(Gf.Vec3f(2, 2, 2))
        # The sublayer's is weaker.
        moved(root.OverridePrim("/world/moved"), 0, 50, 0)
        first = root.DefinePrim("/world/first", "Xform")
        first.GetReferences().AddReference("./part.usdc")
        moved(first, 10, 0, 0)
        moved(root.OverridePrim("/world/first/body"), 0, 5, 0)
        root.OverridePrim("/world/first/detail").SetActive(False)
        second = root.DefinePrim("/world/second")
        second.GetPayloads().AddPayload("package.usdz")
        moved(second, 20, 0, 0)
        group = root.DefinePrim("/world/group")
        group.GetReferences().AddReference("nested/group.usda")
        root.OverridePrim("/world/group/inner").GetVariantSet("lod").SetVariantSelection("high")
        root.CreateClassPrim("/kind")
        splat(root, "/kind/common", count=1)
        heir = root.DefinePrim("/world/heir", "Xform")
        heir.GetInherits().AddInherit("/kind")
        moved(heir, 30, 0, 0)
        special = root.DefinePrim("/world/special", "Xform")
        special.GetSpecializes().AddSpecialize("/kind")
        moved(special, 40, 0, 0)
        with_key = Sdf.Reference("part.usdc", "/part", Sdf.LayerOffset(1, 2), {"key": {"inner": "text"}, "one": 1.5})
        root.DefinePrim("/world/keyed", "Xform").GetReferences().AddReference(with_key)
        root.Save()
        expect(FOLDER / "composed/root.json", [prim for prim in root.Traverse() if prim.GetTypeName() == TYPE])


def surflets():
    stage = simple(False)
    prim = stage.GetPrimAtPath("/splat")
    prim.SetTypeName("ParticleField")
    for name in "PositionAttribute", "OrientationAttribute", "ScaleAttribute", "OpacityAttribute", "KernelGaussianSurflet":
        prim.AddAppliedSchema(f"ParticleField{name}API")
    return stage


if len(sys.argv) == 3:
    stage = simple(False)
    stage.GetRootLayer().Export(sys.argv[1])
    sys.exit()
made = ("floats", simple(False)), ("halves", simple(True)), ("stage", transformed()), ("surflets", surflets())
for name, stage in made:
    save(stage, name)
composed()
os.system(f"{sys.executable} {__file__} {FOLDER / 'old.usdc'} 0.4.0")
UsdUtils.CreateNewUsdzPackage(Sdf.AssetPath(str(FOLDER / "floats.usdc")), str(FOLDER / "package.usdz"))
