"""bakery: one portrait photograph in, one animatable avatar bundle out.

    photo -> detect -> segment -> fit -> condition -> generate -> texture -> mask -> bundle -> runtime

    errors, memo                  what may go wrong; what is computed once and kept
    parallel, paths               work on all cores; where data lies
    check, settings               border checks; options that say what they may be
    types, landmarks, plugins     the records between stages; the 478 points; entry points
    geometry                      cameras, rotations, meshes, rasterising, sampling, light
    preset, formats               presets; file formats, nothing of bundles
    heads, detectors, generators  plug-in points
    stages                        pure functions, one room a step
    hair                          plug-in point
    synth                         synthetic subjects: samples and training pictures
    runtime                       what a player does with a bundle: the reference and the fast player
    export, exporters             what a bundle is; one file a format (plug-in point)
    bake                          the bake: the order of the steps, and what is kept of them
    testing, show, farm           conformance tests of plug-ins; pictures, pages; farms
    motion                        takes: tracked, retargeted, played
    perform                       a performer drives a portrait
    train, evaluate, cli          trainings; measurements; the commands

Imports point down this list. Nothing is imported here: `bakery --help` must not wait for numpy.
"""

__version__ = "0.1.0"
