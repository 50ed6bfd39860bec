"""bakery: one portrait photograph in, one animatable avatar bundle out.

    photo -> detect -> segment -> fit -> condition -> generate -> texture -> mask -> bundle -> runtime

    errors, check, types   what may go wrong, border checks, the records between stages
    landmarks              which of the 478 points mean what
    geometry               cameras, rotations, meshes, rasterising, sampling, light; numpy only
    formats                the part that reads and writes files
    heads, detectors, generators   the three plug-in points
    stages                 pure functions, one a step
    synth                  synthetic subjects: samples and training pictures
    pipeline, train, evaluate, runtime   the bake; trainings; measurements; the player's reference
    cli                    the commands

Nothing is imported here: `bakery --help` must not wait for numpy.
"""

__version__ = "0.1.0"
