"""What docs/guides/blender.md says, run by Blender as a Python module: import, pose, render.

Usage: python blender.py FILE.glb|FILE.usdz WEIGHTS.json OUT. Writes OUT.npz, the points of each mesh
as Blender has them after the shapes (metres, +z up), and OUT.png.
"""

import json
import math
import sys

import bpy
import numpy as np


def main(file, weights, out):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if file.endswith(".glb"):
        bpy.ops.import_scene.gltf(filepath=file)
    else:
        bpy.ops.wm.usd_import(filepath=file, import_textures_mode="IMPORT_PACK")
    for thing in bpy.data.objects:
        if thing.name.endswith(("_LOD1", "_LOD2", "_LOD3")):
            thing.hide_render = thing.hide_viewport = True
    with open(weights) as given:
        for name, weight in json.load(given).items():
            set_shape(name, weight)
    rig = next(thing for thing in bpy.data.objects if thing.type == "ARMATURE")
    bones = [bone.name.replace("/", "_").split("_")[-1] for bone in rig.pose.bones]
    picture(f"{out}.png")
    np.savez(f"{out}.npz", bones=np.array(bones), **points())


def set_shape(name, weight):
    for thing in bpy.data.objects:
        keys = thing.type == "MESH" and thing.data.shape_keys
        if keys and name in keys.key_blocks:
            keys.key_blocks[name].value = weight


def points():
    graph, found = bpy.context.evaluated_depsgraph_get(), {}
    for thing in bpy.data.objects:
        if thing.type != "MESH" or thing.hide_render:
            continue
        mesh = thing.evaluated_get(graph).data
        places = np.zeros(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", places)
        turn = np.array(thing.matrix_world)
        found[thing.name] = places.reshape(-1, 3) @ turn[:3, :3].T + turn[:3, 3]
    return found


def picture(path):
    scene = bpy.context.scene
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    scene.collection.objects.link(camera)
    scene.camera = camera
    camera.location, camera.rotation_euler = (0, -0.62, -0.02), (math.pi / 2, 0, 0)
    camera.data.angle, camera.data.clip_start = math.radians(30), 0.01
    scene.view_settings.view_transform = "Standard"  # else colours are those of a film
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.cycles.samples, scene.cycles.use_denoising = 8, False
    scene.render.resolution_x = scene.render.resolution_y = 200
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)


main(*sys.argv[1:])
